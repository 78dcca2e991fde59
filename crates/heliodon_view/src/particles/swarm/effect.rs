//! What bevy_hanabi is told of a source: an effect whose shaders are ours (flight.wgsl, look.wgsl), put where its own modifiers would write theirs.
//!
//! Its modifiers cannot say what ours must: births that are spread over a frame, motions that are exact in frames of any length, spots that never grow smaller than a pixel, light that
//! is looked up where the sun shines. They are a trait that others may implement, and so these write calls of functions.

use super::super::source::Source;
use super::super::{dust, plume, quad, shower};
use bevy::prelude::*;
use bevy_hanabi::{
    AlphaMode, Attribute, BoxedModifier, EffectAsset, EvalContext, ExprError, Modifier, ModifierContext, Module,
    MotionIntegration, RenderContext, RenderModifier, ShaderWriter, SimulationCondition, SimulationSpace, SpawnerSettings,
    Value, VectorValue,
};
use heliodon_bundle::site::ParticleKind;
use std::fmt::Write;

const FLIGHT_WGSL: &str = include_str!("flight.wgsl");
const LOOK_WGSL: &str = include_str!("look.wgsl");

/// Where it is, and how large beside what is usual.
pub const PLACE: &str = "swarm_place";
/// How far to all sides, and its width.
pub const EXTENT: &str = "swarm_extent";
/// Between which ages this frame's births are, seconds; the time, and what is the source's own of the air's streams.
pub const BORN: &str = "swarm_born";
/// Heights of the ground, four each.
pub const FLOORS: [&str; 7] =
    ["swarm_floor_0", "swarm_floor_1", "swarm_floor_2", "swarm_floor_3", "swarm_floor_4", "swarm_floor_5", "swarm_floor_6"];

/// What is kept of a particle.
const ATTRIBUTES: [Attribute; 8] = [
    Attribute::POSITION,
    Attribute::VELOCITY,
    Attribute::AGE,
    Attribute::LIFETIME,
    Attribute::F32X4_0,
    Attribute::F32X3_0,
    Attribute::F32_0,
    Attribute::F32_1,
];

/// The kinds, as the shaders number them.
const KINDS: [(ParticleKind, &str); 4] = [
    (ParticleKind::Dust, "DUST"),
    (ParticleKind::Smoke, "SMOKE"),
    (ParticleKind::Sparks, "SPARKS"),
    (ParticleKind::Water, "WATER"),
];

/// Whether a device can take a kind over. Fire stays: it is a hundred tongues, not many thousands, and it is a lamp whose light flickers with them.
#[must_use]
pub fn is_swarm_kind(kind: ParticleKind) -> bool {
    KINDS.iter().any(|(known, _)| *known == kind)
}

/// The effect of a source with so many particles at most.
#[must_use]
pub fn effect(source: &Source, capacity: u32) -> EffectAsset {
    let mut module = Module::default();
    for name in [PLACE, EXTENT, BORN].into_iter().chain(FLOORS) {
        module.add_property(name, of_vector(Vec4::ZERO));
    }
    module.add_texture_slot("light");
    let ours = Ours { constants: constants(source.kind) };
    // births are counted by us: see `Flight`
    let spawner = SpawnerSettings::rate(1.0.into());
    EffectAsset::new(capacity, spawner, module)
        .with_name(format!("{}_{:?}", source.name, source.kind))
        .with_simulation_space(SimulationSpace::Global)
        .with_simulation_condition(SimulationCondition::Always)
        .with_motion_integration(MotionIntegration::None)
        .with_alpha_mode(AlphaMode::Premultiply)
        .init(ours.clone())
        .update(ours.clone())
        .render(ours)
}

/// A property's value.
#[must_use]
pub fn of_vector(vector: Vec4) -> Value {
    Value::Vector(VectorValue::new_vec4(vector))
}

/// What the shaders share with the processor's particles.
fn constants(kind: ParticleKind) -> String {
    let own = KINDS.iter().position(|(known, _)| *known == kind).unwrap_or_default();
    let mut out = format!("const KIND: u32 = {own}u;\n");
    for (number, (_, name)) in KINDS.iter().enumerate() {
        let _ = writeln!(out, "const {name}: u32 = {number}u;");
    }
    let albedo = plume::SMOKE_ALBEDO;
    let _ = writeln!(out, "const SMOKE_ALBEDO = vec3<f32>({:?}, {:?}, {:?});", albedo.x, albedo.y, albedo.z);
    for (name, [x, y]) in [("RISES", plume::RISES), ("SPREADS", plume::SPREADS), ("MOTE_SIZES", dust::MOTE_SIZES)] {
        let _ = writeln!(out, "const {name} = vec2<f32>({x:?}, {y:?});");
    }
    for (name, value) in [
        ("GRAVITY", shower::GRAVITY),
        ("SHUTTER_S", shower::SHUTTER_S),
        ("SPARK_S", shower::SPARK_S),
        ("SPARK_M", shower::SPARK_M),
        ("SPARK_WEIGHT", shower::SPARK_WEIGHT),
        ("SPARK_DRAG", shower::SPARK_DRAG),
        ("DROP_M", shower::DROP_M),
        ("SPLASH_S", shower::SPLASH_S),
        ("DROP_SHINES", shower::DROP_SHINES),
        ("GLINT", shower::GLINT),
        ("PUFF_S", plume::PUFF_S),
        ("RISE_M_PER_S", plume::RISE_M_PER_S),
        ("THICKNESS", plume::THICKNESS),
        ("MOTE_M", dust::MOTE_M),
        ("MOTE_S", dust::MOTE_S),
        ("MOTE_SHINES", dust::MOTE_SHINES),
        ("COOLS_S", plume::COOLS_S),
        ("RISE_ON_M_PER_S", plume::RISE_ON_M_PER_S),
        ("LEAN", plume::LEAN),
        ("DRIFT_M", plume::DRIFT_M),
        ("CURL_M", plume::CURL_M),
        ("SPREAD_M_PER_S", plume::SPREAD_M_PER_S),
        ("MOTE_DRIFT_M_PER_S", dust::MOTE_DRIFT_M_PER_S),
        ("MOTE_SWAY_M", dust::MOTE_SWAY_M),
        ("LEAST_PX", quad::LEAST_PX),
        ("FORWARD", quad::FORWARD),
    ] {
        let _ = writeln!(out, "const {name}: f32 = {value:?};");
    }
    out
}

/// Writes calls of our functions into each of an effect's shaders.
#[derive(Clone, Debug, Reflect)]
struct Ours {
    constants: String,
}

impl Modifier for Ours {
    fn context(&self) -> ModifierContext {
        ModifierContext::Init | ModifierContext::Update | ModifierContext::Render
    }

    fn as_render(&self) -> Option<&dyn RenderModifier> {
        Some(self)
    }

    fn as_render_mut(&mut self) -> Option<&mut dyn RenderModifier> {
        Some(self)
    }

    fn into_boxed_render(self: Box<Self>) -> Option<Box<dyn RenderModifier>> {
        Some(self)
    }

    fn attributes(&self) -> &[Attribute] {
        &ATTRIBUTES
    }

    fn boxed_clone(&self) -> BoxedModifier {
        Box::new(self.clone())
    }

    fn apply(&self, _: &mut Module, context: &mut ShaderWriter) -> Result<(), ExprError> {
        let is_birth = context.modifier_context() == ModifierContext::Init;
        context.extra_code += &[&self.constants, FLIGHT_WGSL].concat();
        context.main_code += match is_birth {
            true => "    swarm_born(&particle, particle_counter);\n",
            false => "    is_alive = swarm_moves(&particle) && is_alive;\n",
        };
        Ok(())
    }
}

impl RenderModifier for Ours {
    fn apply_render(&self, _: &mut Module, context: &mut RenderContext) -> Result<(), ExprError> {
        context.set_needs_uv();
        context.set_needs_particle_fragment();
        context.render_extra += &[&self.constants, LOOK_WGSL].concat();
        context.vertex_code += "    let swarm = swarm_quad(position, velocity, f32x4_0.w, f32_0, age / lifetime);
    axis_x = swarm.right;
    axis_y = swarm.up;
    axis_z = swarm.facing;
    size = vec3<f32>(2.0 * swarm.half_size, 1.0);
    color = vec4<f32>(swarm.fainter, swarm.times, 0.0, 0.0);
";
        context.fragment_code +=
            "    color = swarm_shown(vec2<f32>(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y), color.xy, particle);\n";
        Ok(())
    }

    fn boxed_render_clone(&self) -> Box<dyn RenderModifier> {
        Box::new(self.clone())
    }

    fn as_modifier(&self) -> &dyn Modifier {
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::daylight::shader_tests::compile;
    use crate::particles::source::tests::source;

    /// What bevy_hanabi's shaders have before ours.
    const BEFORE: &str = "
struct Particle { position: vec3<f32>, velocity: vec3<f32>, age: f32, lifetime: f32, f32x4_0: vec4<f32>, f32x3_0: vec3<f32>, f32_0: f32, f32_1: f32 }
struct View { clip_from_view: mat4x4<f32>, world_position: vec3<f32>, viewport: vec4<f32> }
struct SimParams { delta_time: f32 }
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> sim_params: SimParams;
@group(2) @binding(3) var<storage, read> properties: array<Properties>;
@group(3) @binding(0) var material_texture_0: texture_2d<f32>;
var<private> properties_array_index: u32;
var<private> seed: u32 = 0u;
const tau: f32 = 6.2831855;
fn pcg_hash(input: u32) -> u32 { return input * 747796405u; }
fn to_float01(u: u32) -> f32 { return f32(u) / 4294967296.0; }
fn frand() -> f32 { seed = pcg_hash(seed); return f32(seed) / 4294967296.0; }
";

    #[test]
    fn the_shaders_of_every_kind_are_valid() {
        for (kind, _) in KINDS {
            let properties: String =
                [PLACE, EXTENT, BORN].into_iter().chain(FLOORS).map(|name| format!("{name}: vec4<f32>,\n")).collect();
            let before = format!("struct Properties {{ {properties} }}\n{BEFORE}{}", constants(kind));
            compile(&format!("{before}{FLIGHT_WGSL}"));
            compile(&format!("{before}{LOOK_WGSL}"));
        }
    }

    #[test]
    fn an_effect_has_room_for_its_source_and_all_that_its_shaders_name() {
        let effect = effect(&source(ParticleKind::Smoke, Vec3::ZERO), 5_000);
        assert_eq!(effect.capacity(), 5_000);
        assert_eq!(effect.properties().len(), 3 + FLOORS.len());
        assert!(ATTRIBUTES.iter().all(|attribute| effect.particle_layout().contains(*attribute)));
        assert!(!is_swarm_kind(ParticleKind::Fire));
    }
}
