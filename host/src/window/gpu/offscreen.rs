//! Drawing without a window: for measuring, for pictures in files, and for tests.

use super::target::FORMAT;
use super::{DITHERING, RenderState, background};
use eframe::egui::{self, Context, FullOutput, RawInput, Rect, Theme, Ui, vec2};
use eframe::egui_wgpu::{RendererOptions, ScreenDescriptor, WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};
use eframe::wgpu;
use std::sync::mpsc;
use std::time::Duration;

/// The card is waited for so long. **Units:** s.
const PATIENCE: Duration = Duration::from_secs(30);

/// Why nothing can be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No graphics card, and no software in its place.
    #[error(
        "nothing here can draw: {0}; a graphics card with its driver is needed, or software in its place (Debian: mesa-vulkan-drivers)"
    )]
    NoAdapter(String),
    /// It did not answer.
    #[error("the graphics card did not finish the picture: {0}")]
    Stuck(String),
}

/// A picture: 4 bytes a pixel, red, green, blue, opacity, from the upper left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width and height. **Units:** px.
    pub size: [u32; 2],
    /// The bytes.
    pub pixels: Vec<u8>,
    /// Drawn by software, not by a graphics card.
    pub in_software: bool,
}

/// How a picture is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheet {
    /// Width and height. **Units:** points.
    pub size: [f32; 2],
    /// Pixels a point.
    pub pixels_per_point: f32,
    /// Light on dark.
    pub dark: bool,
}

/// A graphics card with controls, but no window.
pub struct Studio {
    render: RenderState,
    context: Context,
    seconds: f64,
}

impl std::fmt::Debug for Studio {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Studio").field("adapter", &self.adapter()).finish_non_exhaustive()
    }
}

impl Studio {
    /// Of the best card there is, or of software.
    ///
    /// # Errors
    /// When there is neither.
    pub fn new() -> Result<Self, Error> {
        let setup = WgpuSetup::CreateNew(WgpuSetupCreateNew::without_display_handle());
        let instance = pollster::block_on(setup.new_instance());
        let configuration = WgpuConfiguration { wgpu_setup: setup, ..WgpuConfiguration::default() };
        let options = RendererOptions { dithering: DITHERING, ..RendererOptions::default() };
        let render = RenderState::create(&configuration, &instance, None, options);
        let render = pollster::block_on(render).map_err(|error| Error::NoAdapter(error.to_string()))?;
        Ok(Self { render, context: Context::default(), seconds: 0.0 })
    }

    /// What maps are made with.
    pub fn render(&self) -> &RenderState {
        &self.render
    }

    /// What draws here.
    pub fn adapter(&self) -> String {
        let adapter = self.render.adapter.get_info();
        format!("{} ({:?})", adapter.name, adapter.backend)
    }

    /// Whether somebody asked for another frame.
    pub fn is_asked(&self) -> bool {
        self.context.has_requested_repaint()
    }

    /// Draws one frame and waits until it is there.
    ///
    /// # Errors
    /// When the card does not answer.
    pub fn frame(&mut self, sheet: Sheet, add: impl FnMut(&mut Ui)) -> Result<(), Error> {
        let output = self.run(sheet, add);
        self.draw(sheet, output).map(|_| ())
    }

    /// Draws until nothing moves any more, and reads the picture.
    ///
    /// # Errors
    /// When the card does not answer.
    pub fn picture(&mut self, sheet: Sheet, mut add: impl FnMut(&mut Ui)) -> Result<Picture, Error> {
        const MOST_FRAMES: usize = 120;
        // The first frame learns how large words are.
        self.frame(sheet, &mut add)?;
        for _ in 0..MOST_FRAMES {
            let output = self.run(sheet, &mut add);
            let still =
                output.viewport_output.values().all(|viewport| viewport.repaint_delay > Duration::from_millis(50));
            let texture = self.draw(sheet, output)?;
            if still {
                return self.read(&texture);
            }
        }
        let output = self.run(sheet, &mut add);
        let texture = self.draw(sheet, output)?;
        self.read(&texture)
    }

    fn run(&mut self, sheet: Sheet, mut add: impl FnMut(&mut Ui)) -> FullOutput {
        self.context.set_theme(if sheet.dark { Theme::Dark } else { Theme::Light });
        self.context.set_pixels_per_point(sheet.pixels_per_point);
        self.seconds += 1.0 / 60.0;
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(egui::Pos2::ZERO, vec2(sheet.size[0], sheet.size[1]))),
            time: Some(self.seconds),
            ..RawInput::default()
        };
        self.context.run_ui(input, |ui| add(ui))
    }

    fn draw(&self, sheet: Sheet, mut output: FullOutput) -> Result<wgpu::Texture, Error> {
        let RenderState { device, queue, .. } = &self.render;
        let most = device.limits().max_texture_dimension_2d;
        let pixels = sheet.size.map(|points| ((points * sheet.pixels_per_point).round() as u32).clamp(1, most));
        let screen = ScreenDescriptor { size_in_pixels: pixels, pixels_per_point: sheet.pixels_per_point };
        let shapes = self.context.tessellate(output.shapes, output.pixels_per_point);
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("sheet"),
            size: wgpu::Extent3d { width: pixels[0], height: pixels[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut renderer = self.render.renderer.write();
        for (id, deltas) in output.textures_delta.set.drain() {
            for delta in deltas {
                renderer.update_texture(device, queue, id, &delta);
            }
        }
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut commands = renderer.update_buffers(device, queue, &mut encoder, &shapes, &screen);
        let [r, g, b, a] = background(&self.context.global_style().visuals, FORMAT).map(f64::from);
        let behind = wgpu::Color { r, g, b, a };
        let attachment = wgpu::RenderPassColorAttachment {
            view: &view,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(behind), store: wgpu::StoreOp::Store },
            depth_slice: None,
        };
        let mut pass = encoder
            .begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("sheet"),
                color_attachments: &[Some(attachment)],
                ..Default::default()
            })
            .forget_lifetime();
        renderer.render(&mut pass, &shapes, &screen);
        drop(pass);
        for id in output.textures_delta.free.drain() {
            renderer.free_texture(&id);
        }
        commands.push(encoder.finish());
        queue.submit(commands);
        self.wait()?;
        Ok(texture)
    }

    fn wait(&self) -> Result<(), Error> {
        let wait = wgpu::PollType::Wait { submission_index: None, timeout: Some(PATIENCE) };
        self.render.device.poll(wait).map(|_| ()).map_err(|error| Error::Stuck(error.to_string()))
    }

    fn read(&self, texture: &wgpu::Texture) -> Result<Picture, Error> {
        let (width, height) = (texture.width(), texture.height());
        let row = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.render.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("sheet"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.render.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None },
            },
            texture.size(),
        );
        self.render.queue.submit([encoder.finish()]);
        let (told, answer) = mpsc::channel();
        // Whoever no longer listens does not want to know.
        buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| drop(told.send(result)));
        self.wait()?;
        let stuck = |error: &dyn std::fmt::Display| Error::Stuck(error.to_string());
        answer.recv().map_err(|error| stuck(&error))?.map_err(|error| stuck(&error))?;
        let mapped = buffer.slice(..).get_mapped_range().map_err(|error| stuck(&error))?;
        let used = width as usize * 4;
        let pixels = mapped.chunks_exact(row as usize).flat_map(|bytes| bytes[..used].iter().copied()).collect();
        let in_software = self.render.adapter.get_info().device_type == wgpu::DeviceType::Cpu;
        Ok(Picture { size: [width, height], pixels, in_software })
    }
}
