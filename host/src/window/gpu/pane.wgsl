// A picture that is shown as it is.

@group(0) @binding(0) var picture: texture_2d<f32>;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) pixel: vec2<f32>,
};

@vertex
fn vs_pane(@builtin(vertex_index) index: u32) -> Corner {
    let corner = vec2<f32>(f32(index & 1u), f32(index >> 1u));
    var out: Corner;
    out.position = vec4<f32>(corner.x * 2.0 - 1.0, 1.0 - corner.y * 2.0, 0.0, 1.0);
    out.pixel = corner * vec2<f32>(textureDimensions(picture));
    return out;
}

@fragment
fn fs_pane(in: Corner) -> @location(0) vec4<f32> {
    return textureLoad(picture, vec2<i32>(in.pixel), 0);
}

// Into a window that takes amounts of light, and turns them into what is shown.
@fragment
fn fs_linear(in: Corner) -> @location(0) vec4<f32> {
    let shown = textureLoad(picture, vec2<i32>(in.pixel), 0);
    let low = shown.rgb / 12.92;
    let high = pow((shown.rgb + 0.055) / 1.055, vec3<f32>(2.4));
    return vec4<f32>(select(high, low, shown.rgb < vec3<f32>(0.04045)), shown.a);
}
