//! When the frames of a window have been drawn.
//!
//! Whoever has handed a frame to the graphics card is done long before it is: the card itself tells when it has drawn all of it.

use super::RenderState;
use eframe::egui::{PaintCallbackInfo, Ui};
use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait, ScreenDescriptor};
use eframe::wgpu;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

/// So often the card is asked whether a frame is drawn.
const LOOK: Duration = Duration::from_micros(500);
/// A frame that takes longer is not waited for: it was never handed on.
const PATIENCE: Duration = Duration::from_secs(5);

/// A frame that was drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// When the window began with it.
    pub begun: Instant,
    /// When the card had drawn it.
    pub drawn: Instant,
}

/// Watches the frames of a window.
#[derive(Debug)]
pub struct Frames {
    waited: Sender<Arc<AtomicBool>>,
    told: Sender<Frame>,
    drawn: Receiver<Frame>,
}

impl Frames {
    /// Of windows that this draws.
    pub fn new(render: &RenderState) -> Self {
        let (told, drawn) = channel();
        let (waited, waiting) = channel();
        let device = render.device.clone();
        // The card tells nothing to who does not ask, and the window has no time for that.
        std::thread::spawn(move || wait(&device, &waiting));
        Self { waited, told, drawn }
    }

    /// Watches the frame that is being laid out, with which the window began at some time.
    pub fn watch(&self, ui: &Ui, begun: Instant) {
        let watch = Watch { begun, waited: self.waited.clone(), told: self.told.clone() };
        ui.painter().add(Callback::new_paint_callback(ui.max_rect(), watch));
    }

    /// Those that were drawn since somebody asked, the oldest first.
    pub fn drawn(&self) -> impl Iterator<Item = Frame> {
        self.drawn.try_iter()
    }
}

fn wait(device: &wgpu::Device, waiting: &Receiver<Arc<AtomicBool>>) {
    for drawn in waiting {
        let begun = Instant::now();
        while !drawn.load(Ordering::Relaxed) && begun.elapsed() < PATIENCE {
            std::thread::sleep(LOOK);
            if device.poll(wgpu::PollType::Poll).is_err() {
                break;
            }
        }
    }
}

/// Goes with a frame to the card.
struct Watch {
    begun: Instant,
    waited: Sender<Arc<AtomicBool>>,
    told: Sender<Frame>,
}

impl CallbackTrait for Watch {
    fn prepare(
        &self,
        _: &wgpu::Device,
        _: &wgpu::Queue,
        _: &ScreenDescriptor,
        encoder: &mut wgpu::CommandEncoder,
        _: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let drawn = Arc::new(AtomicBool::new(false));
        let (begun, told, known) = (self.begun, self.told.clone(), drawn.clone());
        encoder.on_submitted_work_done(move || {
            known.store(true, Ordering::Relaxed);
            // Nobody listens any more when the window has gone.
            let _ = told.send(Frame { begun, drawn: Instant::now() });
        });
        let _ = self.waited.send(drawn);
        Vec::new()
    }

    fn paint(&self, _: PaintCallbackInfo, _: &mut wgpu::RenderPass<'static>, _: &CallbackResources) {}
}
