// The building and what is drawn on it. Lengths in metres unless they are called pixels.

struct Globals {
    matrix: mat4x4<f32>,
    // Width and height of the picture in pixels, pixels a point, how far apart floors stand.
    picture: vec4<f32>,
    // Height of the lowest floor, of the ground, metres a pixel (for each metre of depth unless flat), 1 if flat.
    world: vec4<f32>,
    // Height of walls, opacity of particles, spacing of the grid, radius of the ground.
    style: vec4<f32>,
    // Middle of the ground.
    middle: vec4<f32>,
    casing: vec4<f32>,
    palette: array<vec4<f32>, 12>,
};

struct Storey {
    // Height where it is shown, opacity of its ground, of its walls, of what is drawn on it.
    numbers: vec4<f32>,
};

@group(0) @binding(0) var<uniform> globals: Globals;
@group(0) @binding(1) var<uniform> storey: Storey;

const WALL = 6u;
const CAP = 7u;
const DOOR = 8u;
const TREAD = 9u;
const LIGHT = vec3<f32>(-0.46, -0.66, 0.6);

fn metres_per_pixel(w: f32) -> f32 {
    return globals.world.z * select(w, 1.0, globals.world.w > 0.5);
}

fn spread(height: f32) -> f32 {
    return globals.world.x + (height - globals.world.x) * globals.picture.w;
}

fn strip(index: u32) -> vec2<f32> {
    return vec2<f32>(f32(index & 1u), f32(index >> 1u)) * 2.0 - 1.0;
}

// Surfaces.

struct Surface {
    @builtin(position) position: vec4<f32>,
    @location(0) colour: vec4<f32>,
};

@vertex
fn vs_surface(
    @location(0) at: vec3<f32>,
    @location(1) side: vec2<f32>,
    @location(2) normal: vec3<f32>,
    @location(3) @interpolate(flat) material: u32,
) -> Surface {
    let raised = material == WALL || material == CAP;
    let stretch = select(select(1.0, globals.picture.w, material == TREAD), globals.style.x, raised);
    let height = storey.numbers.x + at.z * stretch;
    // From afar a wall is as thin as nothing: never thinner than this on the picture.
    let pixel = metres_per_pixel((globals.matrix * vec4<f32>(at.xy, height, 1.0)).w);
    let thin = max(length(side), 1e-6);
    let least = select(0.0, 0.55 * globals.picture.z * pixel, raised || material == DOOR);
    let place = vec3<f32>(at.xy + side * max(1.0, least / thin), height);
    var out: Surface;
    out.position = globals.matrix * vec4<f32>(place, 1.0);
    var shade = 1.0;
    if normal.z < 0.5 {
        shade = 0.84 + 0.16 * dot(normal, LIGHT);
        // As if less light came to the foot of a wall.
        if material == WALL { shade *= mix(0.86, 1.0, at.z); }
    }
    let opacity = select(storey.numbers.y, storey.numbers.z, raised || material == TREAD);
    out.colour = vec4<f32>(globals.palette[material].rgb * shade, opacity);
    return out;
}

@fragment
fn fs_surface(in: Surface) -> @location(0) vec4<f32> {
    return in.colour;
}

// The ground around the building, with a grid that fades away.

struct Ground {
    @builtin(position) position: vec4<f32>,
    @location(0) place: vec2<f32>,
};

@vertex
fn vs_ground(@builtin(vertex_index) index: u32) -> Ground {
    var out: Ground;
    out.place = strip(index) * globals.style.w;
    out.position = globals.matrix * vec4<f32>(globals.middle.xy + out.place, globals.world.y, 1.0);
    return out;
}

fn lines(place: vec2<f32>, spacing: f32) -> f32 {
    let cell = place / spacing;
    let width = max(fwidth(cell), vec2<f32>(1e-6));
    let near = abs(fract(cell - 0.5) - 0.5) / width;
    // Where lines are closer than pixels there is only their mean.
    let seen = clamp(1.0 - min(near, vec2<f32>(1.0)), vec2<f32>(0.0), vec2<f32>(1.0)) * clamp(1.0 - width * 2.0, vec2<f32>(0.0), vec2<f32>(1.0));
    return max(seen.x, seen.y);
}

@fragment
fn fs_ground(in: Ground) -> @location(0) vec4<f32> {
    let away = length(in.place) / globals.style.w;
    let fade = 1.0 - smoothstep(0.25, 1.0, away);
    let world = in.place + globals.middle.xy;
    let grid = max(lines(world, globals.style.z) * 0.55, lines(world, globals.style.z * 5.0));
    let colour = mix(globals.palette[10].rgb, globals.palette[11].rgb, grid);
    return vec4<f32>(colour, fade);
}

// Particles: round dots.

struct Dot {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(linear) from_middle: vec2<f32>,
    @location(1) colour: vec4<f32>,
    @location(2) @interpolate(flat) radius: f32,
};

// The smallest triangle around a circle: half the work of a square where there is no graphics card.
fn around(index: u32) -> vec2<f32> {
    return vec2<f32>(f32(index) * 1.7320508 - 1.7320508, select(-1.0, 2.0, index == 1u));
}

fn dot_at(index: u32, at: vec3<f32>, colour: vec4<f32>, opacity: f32) -> Dot {
    let place = globals.matrix * vec4<f32>(at.xy, spread(at.z) + 0.08, 1.0);
    let radius = clamp(0.075 / metres_per_pixel(place.w), 0.95 * globals.picture.z, 3.2 * globals.picture.z);
    let corner = around(index) * (radius + 0.5);
    var out: Dot;
    out.position = place + vec4<f32>(corner * 2.0 / globals.picture.xy * place.w, 0.0, 0.0);
    out.from_middle = corner;
    out.colour = vec4<f32>(colour.rgb, colour.a * opacity * globals.style.y * storey.numbers.w);
    out.radius = radius;
    return out;
}

@vertex
fn vs_dot(@builtin(vertex_index) index: u32, @location(0) at: vec3<f32>, @location(1) colour: vec4<f32>) -> Dot {
    return dot_at(index, at, colour, 1.0);
}

// What stands behind a wall shines through it.
@vertex
fn vs_dot_behind(@builtin(vertex_index) index: u32, @location(0) at: vec3<f32>, @location(1) colour: vec4<f32>) -> Dot {
    return dot_at(index, at, colour, 0.3);
}

@fragment
fn fs_dot(in: Dot) -> @location(0) vec4<f32> {
    let cover = clamp(in.radius + 0.5 - length(in.from_middle), 0.0, 1.0);
    return vec4<f32>(in.colour.rgb, in.colour.a * cover);
}

// Ways: pieces of lines with round ends, as wide as a number of points wherever they are.

struct Line {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(linear) place: vec2<f32>,
    @location(1) colour: vec4<f32>,
    // Half the width and the length in pixels.
    @location(2) @interpolate(flat) size: vec2<f32>,
};

fn line_at(index: u32, a: vec3<f32>, b: vec3<f32>, half: f32, colour: vec4<f32>) -> Line {
    var ends = array<vec4<f32>, 2>(
        globals.matrix * vec4<f32>(a.xy, spread(a.z) + 0.1, 1.0),
        globals.matrix * vec4<f32>(b.xy, spread(b.z) + 0.1, 1.0),
    );
    // What is behind the eye is cut off.
    if ends[0].z < 0.0 && ends[1].z > 0.0 { ends[0] = mix(ends[0], ends[1], ends[0].z / (ends[0].z - ends[1].z)); }
    if ends[1].z < 0.0 && ends[0].z > 0.0 { ends[1] = mix(ends[1], ends[0], ends[1].z / (ends[1].z - ends[0].z)); }
    let pixels = globals.picture.xy * 0.5;
    let begin = ends[0].xy / ends[0].w * pixels;
    let finish = ends[1].xy / ends[1].w * pixels;
    let far = length(finish - begin);
    let along = select(vec2<f32>(1.0, 0.0), (finish - begin) / max(far, 1e-6), far > 1e-6);
    let corner = strip(index);
    let reach = half + 1.0;
    let second = corner.x > 0.0;
    let end = select(ends[0], ends[1], second);
    let out_by = along * corner.x * reach + vec2<f32>(-along.y, along.x) * corner.y * reach;
    var out: Line;
    out.position = end + vec4<f32>(out_by / pixels * end.w, 0.0, 0.0);
    out.place = vec2<f32>(select(-reach, far + reach, second), corner.y * reach);
    out.colour = vec4<f32>(colour.rgb, colour.a * storey.numbers.w);
    out.size = vec2<f32>(half, far);
    return out;
}

@vertex
fn vs_line(
    @builtin(vertex_index) index: u32,
    @location(0) a: vec3<f32>,
    @location(1) b: vec3<f32>,
    @location(2) colour: vec4<f32>,
    @location(3) width: f32,
) -> Line {
    return line_at(index, a, b, 0.5 * width * globals.picture.z, colour);
}

@vertex
fn vs_casing(
    @builtin(vertex_index) index: u32,
    @location(0) a: vec3<f32>,
    @location(1) b: vec3<f32>,
    @location(2) colour: vec4<f32>,
    @location(3) width: f32,
) -> Line {
    return line_at(index, a, b, (0.5 * width + 1.1) * globals.picture.z, vec4<f32>(globals.casing.rgb, 0.9));
}

@fragment
fn fs_line(in: Line) -> @location(0) vec4<f32> {
    let beyond = max(max(-in.place.x, in.place.x - in.size.y), 0.0);
    let cover = clamp(in.size.x + 0.5 - length(vec2<f32>(beyond, in.place.y)), 0.0, 1.0);
    return vec4<f32>(in.colour.rgb, in.colour.a * cover);
}
