// How a swarm's particles are seen, in bevy_hanabi's render shader: as air.wgsl draws quads, as exposed radiance and the share of what is behind that they take away. Written
// into by effect.rs, which prepends KIND, the kinds and their constants.
//
// What is known of their light lies in the texture `material_texture_0`, whose texels are the bytes of numbers: bevy_hanabi lets a fragment read nothing else. Its first row
// is `SwarmLight` of mod.rs, the rows below are the map of the sun.

fn swarm_number(at: vec2<u32>) -> f32 {
    return bitcast<f32>(pack4x8unorm(textureLoad(material_texture_0, at, 0)));
}

fn swarm_numbers(first: u32) -> vec4<f32> {
    return vec4<f32>(
        swarm_number(vec2<u32>(first, 0u)), swarm_number(vec2<u32>(first + 1u, 0u)),
        swarm_number(vec2<u32>(first + 2u, 0u)), swarm_number(vec2<u32>(first + 3u, 0u)),
    );
}

fn swarm_depth(at: vec2<u32>) -> f32 {
    return swarm_number(at + vec2<u32>(0u, 1u));
}

// The part of the sun that reaches a place, between the four texels around it: as `SunMap::at`.
fn swarm_sun_at(place: vec3<f32>) -> f32 {
    let size = swarm_numbers(12u);
    let world = vec4<f32>(place, 1.0);
    let at = vec2<f32>(dot(swarm_numbers(0u), world), dot(swarm_numbers(4u), world));
    if (any(at < vec2<f32>(0.0)) || any(at >= size.xy - 1.0)) {
        return size.z;
    }
    let own = dot(swarm_numbers(8u), world);
    let low = vec2<u32>(at);
    let part = fract(at);
    let below = vec2<f32>(swarm_depth(low), swarm_depth(low + vec2<u32>(1u, 0u)));
    let above = vec2<f32>(swarm_depth(low + vec2<u32>(0u, 1u)), swarm_depth(low + vec2<u32>(1u, 1u)));
    let lit = select(vec4<f32>(0.0), vec4<f32>(1.0), vec4<f32>(own) >= vec4<f32>(below, above));
    let across = mix(lit.xz, lit.yw, vec2<f32>(part.x));
    return mix(across.x, across.y, part.y);
}

// Henyey and Greenstein, "Diffuse radiation in the galaxy", 1941: of an isotropic medium 1 in every direction.
fn swarm_phase(cosine: f32) -> f32 {
    let below = max(1.0 + FORWARD * FORWARD - 2.0 * FORWARD * cosine, 1e-4);
    return (1.0 - FORWARD * FORWARD) / (below * sqrt(below));
}

// Dave Hoskins, "Hash without Sine", 2014.
fn swarm_hash(p: vec2<f32>) -> f32 {
    var q = fract(p.xyx * 0.1031);
    q += dot(q, q.yzx + 33.33);
    return fract((q.x + q.y) * q.z);
}

fn swarm_noise(p: vec2<f32>) -> f32 {
    let whole = floor(p);
    let part = fract(p);
    let eased = part * part * (3.0 - 2.0 * part);
    let below = mix(swarm_hash(whole), swarm_hash(whole + vec2<f32>(1.0, 0.0)), eased.x);
    let above = mix(swarm_hash(whole + vec2<f32>(0.0, 1.0)), swarm_hash(whole + vec2<f32>(1.0, 1.0)), eased.x);
    return mix(below, above, eased.y);
}

// The sides of a quad at a place that faces the eye.
struct SwarmQuad {
    right: vec3<f32>,
    up: vec3<f32>,
    facing: vec3<f32>,
    // Half its width and height.
    half_size: vec2<f32>,
    // How much of its light is seen, and how many times as high as wide it is.
    fainter: f32,
    times: f32,
}

fn swarm_quad(place: vec3<f32>, velocity: vec3<f32>, whole_radius: f32, own: f32, age: f32) -> SwarmQuad {
    let to_eye = view.world_position - place;
    let distance = max(length(to_eye), 1e-3);
    var quad: SwarmQuad;
    quad.facing = to_eye / distance;
    let upright = abs(quad.facing.y) < 0.999;
    let level = normalize(select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(quad.facing.z, 0.0, -quad.facing.x), upright));
    quad.right = level;
    quad.up = cross(quad.facing, level);
    var radius = whole_radius;
    // as long as it is seen, and as what moves goes while a picture is taken
    let speed = length(velocity);
    quad.times = 1.0 + speed * SHUTTER_S / (2.0 * radius);
    var times = 1.0;
    if (KIND == SMOKE) {
        let turn = tau * own + (own - 0.5) * 3.0 * age;
        quad.right = level * cos(turn) + quad.up * sin(turn);
        quad.up = cross(quad.facing, quad.right);
    } else if (speed > 1e-3) {
        let along = velocity / speed;
        let seen = along - quad.facing * dot(along, quad.facing);
        let length_seen = length(seen);
        if (length_seen > 1e-3) {
            quad.up = seen / length_seen;
            quad.right = cross(quad.up, quad.facing);
        }
        times = max(1.0, quad.times * length_seen);
    }
    quad.fainter = 1.0;
    if (KIND != SMOKE) {
        let pixels = radius * view.clip_from_view[1][1] * 0.5 * view.viewport.w / distance;
        let grown = max(1.0, LEAST_PX / max(pixels, 1e-4));
        radius *= grown;
        times = max(1.0, times / grown);
        quad.fainter = 1.0 / (grown * select(grown, 1.0, times > 1.0));
    }
    // what is wholly about the eye would fill the picture
    quad.fainter *= clamp(distance / max(2.0 * radius, 0.02) - 0.25, 0.0, 1.0);
    quad.half_size = vec2<f32>(radius, radius * times);
    return quad;
}

// What is seen of a particle at a place of its quad, from -1 to 1. `seen` is what `swarm_quad` said: fainter, times.
fn swarm_shown(at: vec2<f32>, seen: vec2<f32>, particle: Particle) -> vec4<f32> {
    let r = length(at);
    if (r >= 1.0) {
        return vec4<f32>(0.0);
    }
    let own = particle.f32_0;
    let age_s = particle.age;
    let age = clamp(age_s / particle.lifetime, 0.0, 1.0);
    let profile = 1.0 - r * r;
    let spot = profile * profile * seen.x;
    if (KIND == SPARKS) {
        // it cools from yellow to red, and flares up now and then
        let heat = pow(1.0 - age, 0.7);
        let flare = 1.0 + 0.5 * sin(31.0 * age_s + 40.0 * own) * sin(17.0 * age_s);
        let color = vec3<f32>(1.0, 0.52 * pow(heat, 1.3), 0.16 * heat * heat * heat);
        let flame = swarm_numbers(24u).w;
        return vec4<f32>(color * (13.0 * flame * heat * max(flare, 0.2) / sqrt(seen.y) * spot), 0.0);
    }
    let sun = swarm_numbers(16u);
    let sunward = swarm_numbers(20u).xyz;
    let around = swarm_numbers(24u).rgb;
    let facing = normalize(view.world_position - particle.position);
    let scattered = swarm_phase(dot(-facing, sunward));
    let lit = swarm_sun_at(particle.position);
    if (KIND == DUST) {
        // it turns, and shows now its face and now its edge
        let turned = 0.55 + 0.45 * sin(particle.f32_1 * age_s + tau * fract(own * 57.0));
        let ends = min(min(age * 6.0, 1.0), (1.0 - age) * 6.0);
        return vec4<f32>(sun.rgb * (lit * scattered * MOTE_SHINES * turned * ends * sun.w * spot), 0.0);
    }
    if (KIND == WATER) {
        // few of them at a time turn the sun to the eye
        let turned = max(fract(own * 57.0 + particle.position.y * 3.1) - 0.8, 0.0) * 5.0;
        let glint = sun.rgb * (lit * scattered * (0.15 + GLINT * turned * turned));
        return vec4<f32>((around * DROP_SHINES + glint) * spot, 0.5 * spot);
    }
    let noise_at = at * 1.7 + vec2<f32>(61.0 * own, 103.7 * own + age * 1.5);
    let torn = 0.57 * swarm_noise(noise_at) + 0.29 * swarm_noise(noise_at * 2.03 + 17.1) + 0.14 * swarm_noise(noise_at * 4.1 + 5.7);
    let cover = clamp(profile * (0.35 + 1.3 * torn) - 0.22 * (1.0 - profile), 0.0, 1.0);
    let opacity = min(THICKNESS * particle.f32_1 * min(age * 7.0, 1.0) * pow(1.0 - age, 0.8), 0.9);
    let whole = opacity * cover * seen.x;
    // lit as a ball is, softly: light goes through it and around
    let quad = swarm_quad(particle.position, vec3<f32>(0.0), particle.f32x4_0.w, own, age);
    let ball = quad.right * at.x + quad.up * at.y + quad.facing * sqrt(profile);
    let towards = clamp(0.5 + 0.5 * dot(ball, sunward) + 0.5 * (torn - 0.5), 0.0, 1.0);
    let by_phase = 0.55 + 0.45 * scattered;
    let light = around * (0.8 + 0.4 * torn) + sun.rgb * (0.5 * lit * by_phase * (0.25 + 1.1 * towards));
    return vec4<f32>(light * SMOKE_ALBEDO * whole, whole);
}
