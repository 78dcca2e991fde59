// How a swarm's particles are born and fly, in bevy_hanabi's compute shaders: the motions of dust.rs, plume.rs and shower.rs, each a closed function of a particle's age and of
// what it was born with, so that a frame may take any time. Written into by effect.rs, which prepends KIND, the kinds and their constants.
//
// Of a particle: f32x4_0 is where it began and its radius, f32x3_0 how it was thrown, f32_0 a random number of its own, f32_1 another that its kind takes up.

fn swarm_between(least: f32, most: f32) -> f32 {
    return mix(least, most, frand());
}

// The height of the ground beneath a place: `Source::floor`.
fn swarm_floor(at: vec2<f32>) -> f32 {
    let own = &properties[properties_array_index];
    let extent = (*own).swarm_extent.xz;
    let part = (at - (*own).swarm_place.xz + extent) / max(2.0 * extent, vec2<f32>(1e-3)) * 4.0 + 0.5;
    let cell = vec2<u32>(clamp(part, vec2<f32>(0.0), vec2<f32>(4.0)));
    let number = cell.y * 5u + cell.x;
    var heights = array<vec4<f32>, 7>(
        (*own).swarm_floor_0, (*own).swarm_floor_1, (*own).swarm_floor_2, (*own).swarm_floor_3,
        (*own).swarm_floor_4, (*own).swarm_floor_5, (*own).swarm_floor_6,
    );
    return heights[number / 4u][number % 4u];
}

// Smooth noise of one number, 0 to 1.
fn swarm_wave(salt: u32, at: f32) -> f32 {
    let whole = floor(at);
    let part = at - whole;
    let first = u32(i32(whole));
    let values = vec2<f32>(to_float01(pcg_hash(salt ^ pcg_hash(first))), to_float01(pcg_hash(salt ^ pcg_hash(first + 1u))));
    return mix(values.x, values.y, part * part * (3.0 - 2.0 * part));
}

// Whither the air streamed at a time.
fn swarm_lean(salt: u32, at_s: f32) -> vec2<f32> {
    return vec2<f32>(swarm_wave(salt, at_s * 0.9), swarm_wave(salt + 1u, at_s * 1.1)) * (2.0 * LEAN) - LEAN;
}

// `number` is another for every birth.
fn swarm_born(particle: ptr<function, Particle>, number: u32) {
    seed = pcg_hash(seed ^ pcg_hash(number));
    let place = properties[properties_array_index].swarm_place;
    let extent = properties[properties_array_index].swarm_extent;
    let born = properties[properties_array_index].swarm_born;
    let size = place.w;
    let own = frand();
    var base = vec3<f32>(swarm_between(-1.0, 1.0), swarm_between(-1.0, 1.0), swarm_between(-1.0, 1.0)) * extent.xyz;
    let turned = swarm_between(0.0, tau);
    let turn = vec2<f32>(cos(turned), sin(turned));
    var thrown = vec3<f32>(0.0);
    var radius = 0.0;
    var life = 1.0;
    var more = 0.0;
    let age_s = mix(born.x, born.y, frand());
    if (KIND == SPARKS) {
        let tilt = sqrt(frand()) * 0.75;
        thrown = vec3<f32>(turn.x * sin(tilt), cos(tilt), turn.y * sin(tilt)) * (swarm_between(1.2, 3.6) * sqrt(size));
        radius = SPARK_M * size * swarm_between(0.6, 1.3);
        life = SPARK_S * swarm_between(0.35, 1.0);
    } else if (KIND == WATER) {
        let from_y = place.y + base.y;
        more = sqrt(2.0 * max(from_y - swarm_floor(place.xz + base.xz), 0.0) / GRAVITY);
        thrown = vec3<f32>(turn.x * swarm_between(0.25, 0.9), swarm_between(0.7, 1.5), turn.y * swarm_between(0.25, 0.9)) * sqrt(size);
        radius = DROP_M * size * swarm_between(0.7, 1.25);
        life = more + SPLASH_S;
    } else if (KIND == SMOKE) {
        base *= vec3<f32>(0.6, 1.0, 0.6);
        let lean = swarm_lean(u32(born.w), born.z - age_s);
        thrown = vec3<f32>(lean.x, swarm_between(RISES.x, RISES.y), lean.y);
        radius = (0.5 * extent.w + 0.05) * size;
        life = PUFF_S * swarm_between(0.7, 1.0);
    } else {
        thrown = vec3<f32>(swarm_between(-1.0, 1.0), 0.4 * swarm_between(-1.0, 1.0) - 0.25, swarm_between(-1.0, 1.0)) * MOTE_DRIFT_M_PER_S;
        radius = MOTE_M * size * (MOTE_SIZES.x + MOTE_SIZES.y * own * own * own);
        life = MOTE_S;
        more = swarm_between(0.8, 3.5);
    }
    (*particle).f32x4_0 = vec4<f32>(place.xyz + base, radius);
    (*particle).f32x3_0 = thrown;
    (*particle).f32_0 = own;
    (*particle).f32_1 = more;
    (*particle).position = place.xyz + base;
    (*particle).velocity = vec3<f32>(0.0);
    (*particle).lifetime = life;
    // births are spread over the frame, and this frame's time is added to all
    (*particle).age = age_s - sim_params.delta_time;
}

// Whether it is still there.
fn swarm_moves(particle: ptr<function, Particle>) -> bool {
    let age_s = (*particle).age;
    let start = (*particle).f32x4_0.xyz;
    let thrown = (*particle).f32x3_0;
    let own = (*particle).f32_0;
    let phase = tau * fract(own * 57.0);
    if (KIND == SPARKS) {
        // with linear drag k towards the velocity of falling g / k
        let falling = vec3<f32>(0.0, -GRAVITY * SPARK_WEIGHT / SPARK_DRAG, 0.0);
        let braked = exp(-SPARK_DRAG * age_s);
        let whirl = vec3<f32>(sin(9.0 * age_s + phase), 0.0, sin(8.0 * age_s + 2.0 * phase)) * (0.05 * age_s);
        (*particle).position = start + (thrown - falling) * ((1.0 - braked) / SPARK_DRAG) + falling * age_s + whirl;
        (*particle).velocity = (thrown - falling) * braked + falling;
        return (*particle).position.y >= swarm_floor((*particle).position.xz);
    }
    if (KIND == WATER) {
        let lands_s = (*particle).f32_1;
        if (age_s < lands_s) {
            (*particle).position = start - vec3<f32>(0.0, 0.5 * GRAVITY * age_s * age_s, 0.0);
            (*particle).velocity = vec3<f32>(0.0, -GRAVITY * age_s, 0.0);
            return true;
        }
        let since_s = age_s - lands_s;
        let off = thrown * since_s - vec3<f32>(0.0, 0.5 * GRAVITY * since_s * since_s, 0.0);
        (*particle).position = start - vec3<f32>(0.0, 0.5 * GRAVITY * lands_s * lands_s, 0.0) + off;
        (*particle).velocity = thrown - vec3<f32>(0.0, GRAVITY * since_s, 0.0);
        return off.y >= 0.0;
    }
    if (KIND == SMOKE) {
        let size = properties[properties_array_index].swarm_place.w;
        let first = (0.5 * properties[properties_array_index].swarm_extent.w + 0.05) * size;
        let there_s = max(age_s, 0.0);
        let drift = thrown.xz * (DRIFT_M * there_s * sqrt(there_s));
        let curl = vec2<f32>(sin(1.1 * there_s + phase) - sin(phase), cos(0.9 * there_s + 2.0 * phase) - cos(2.0 * phase))
            * (CURL_M * sqrt(there_s));
        // it slows as it cools
        let rise = RISE_M_PER_S * sqrt(size) * COOLS_S * (1.0 - exp(-there_s / COOLS_S)) * thrown.y + RISE_ON_M_PER_S * there_s;
        let radius = first + SPREAD_M_PER_S * size * there_s * mix(SPREADS.x, SPREADS.y, fract(own * 91.7));
        (*particle).position = start + vec3<f32>(drift.x + curl.x, rise, drift.y + curl.y);
        (*particle).f32x4_0.w = radius;
        // the same smoke in more air
        (*particle).f32_1 = pow(first / radius, 0.7);
        return true;
    }
    let sway = vec3<f32>(sin(0.7 * age_s + phase), sin(0.5 * age_s + 2.0 * phase), cos(0.6 * age_s + 3.0 * phase)) * MOTE_SWAY_M;
    (*particle).position = start + thrown * (age_s - 0.5 * MOTE_S) + sway;
    return true;
}
