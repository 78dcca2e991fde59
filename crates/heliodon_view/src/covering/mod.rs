//! What parts, things and actors are covered with, how much of them is there, and how they are marked, while a site is visited.
//!
//! Scripts ask for it (`material`, `fade`, `highlight`), programs by [`Covering`]'s methods. A **material** spreads over what it covers, from below or from where it was
//! applied ([`Covering::begin_at`]), and is at the end exactly its albedo, with what its `grain` leaves of the shades below; details and weathering lie upon it
//! as upon the stone. **Metal** reflects what is around: the six sides of the bundle's light grid there, or the open sky, cut where
//! the surface's own baked light is; the sun, where its mask says so, and lamps, as burnished metal does. What is **faded** is drawn pixel by pixel or not
//! at all (a screen door), so that nothing need be sorted; it hides nothing from culling, and what actors cast pales with them. What is **marked** pulses towards
//! a brightness of its own, with a bright line in a dark one around it: seen in the dark, in the sun, and by who sees no colours.
//!
//! Light is not baked again: what the bare stone has reflected onto its neighbours stays its own colour, and the shadow of a part that has faded stays where
//! it was. Item buffers (daylight/raster.rs) show covers without metal once they have spread; while there is more, such a camera draws triangles.
//!
//! What wears anything is drawn by pipelines of its own, whose instances say which; all else by those that it always had, so that frames in which nothing
//! is worn cost what they did. A view binds the table of all covers beside its own uniform, for portable devices have but four groups of bindings.

mod extent;
pub mod gpu;
mod stone;
pub mod subject;
pub mod uniform;

use crate::actors::render::{ActorsFrame, prepare_actors};
use crate::actors::{Actors, Field};
use crate::costs::FrameTold;
use crate::impostor::Impostors;
use crate::stage::Stage;
use crate::stage::frame::StageFrame;
use crate::story::Wishes;
use crate::time_lapse::{Now, SettleMoment};
use bevy::prelude::*;
use bevy::render::extract_resource::ExtractResourcePlugin;
use bevy::render::{Render, RenderApp, RenderSystems};
use extent::{Extents, boxed};
use glam::Affine3A;
use gpu::{Coat, CoversFrame, CoversGpu, Sight, Worn};
use heliodon_bundle::grid::AXES;
use heliodon_bundle::site::Material;
use heliodon_script::action::Action;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::f32::consts::{FRAC_1_PI, TAU};
use subject::Subject;
use uniform::{CoverUniform, CoversHead, Extent, SLOTS};

/// WGSL of what is worn; the number of its slots and of an instance's bits are before it.
#[must_use]
pub fn cover_wgsl() -> String {
    format!("const COVERS: u32 = {SLOTS}u;\nconst OWN_BITS: u32 = {}u;\n{}", uniform::OWN_BITS, include_str!("cover.wgsl"))
}

/// WGSL of outlines.
pub(crate) const OUTLINE_WGSL: &str = include_str!("outline.wgsl");

/// What marks shine in, times the exposure: a warm light that is neither white nor dark to any eye.
pub(crate) const MARK: Vec3 = Vec3::new(0.95, 0.52, 0.08);
/// How often they pulse, seconds.
const PULSE_S: f32 = 1.6;
/// How far from something it is asked what is around it, metres.
const AROUND_M: f32 = 0.3;

/// What is worn on the stage.
#[derive(Resource, Default)]
pub struct Covering {
    stage: u64,
    worn: BTreeMap<String, Dressed>,
    asked: Vec<Asked>,
    /// Where the next material of something begins, in the world.
    beginnings: HashMap<String, Vec3>,
    told: HashSet<String>,
    /// What is known of the bundle's parts, and of how many chunks.
    parts: (usize, HashMap<String, Extent>),
}

/// Something that wears something.
#[derive(Debug)]
struct Dressed {
    slot: u32,
    subject: Subject,
}

/// What somebody asks for.
#[derive(Clone, Debug)]
enum Asked {
    Cover { target: String, material: Material, seconds: f32 },
    Bare { target: String, seconds: f32 },
    Fade { what: String, opacity: f32, seconds: f32 },
    Highlight { what: String, on: bool },
}

impl Covering {
    /// Lets a material spread over a part or a thing.
    pub fn cover(&mut self, target: &str, material: Material, seconds: f32) {
        self.asked.push(Asked::Cover { target: target.to_owned(), material, seconds });
    }

    /// Takes the materials off a part or a thing again.
    pub fn bare(&mut self, target: &str, seconds: f32) {
        self.asked.push(Asked::Bare { target: target.to_owned(), seconds });
    }

    /// Makes a part, a thing or an actor more or less transparent.
    pub fn fade(&mut self, what: &str, opacity: f32, seconds: f32) {
        self.asked.push(Asked::Fade { what: what.to_owned(), opacity, seconds });
    }

    /// Marks a part, a thing or an actor, or no longer.
    pub fn highlight(&mut self, what: &str, on: bool) {
        self.asked.push(Asked::Highlight { what: what.to_owned(), on });
    }

    /// Lets the next material of something spread from a place of the world: where a hand has applied it.
    pub fn begin_at(&mut self, target: &str, place: Vec3) {
        self.beginnings.insert(target.to_owned(), place);
    }

    /// The material that something is covered with, or is just being, and how far it has spread, 0 to 1.
    #[must_use]
    pub fn of(&self, name: &str) -> Option<(&str, f32)> {
        self.worn.get(name)?.subject.material()
    }

    /// How much of something is there, 0 to 1.
    #[must_use]
    pub fn opacity(&self, name: &str) -> f32 {
        self.worn.get(name).map_or(1.0, |dressed| dressed.subject.opacity())
    }

    /// How much something is marked, 0 to 1.
    #[must_use]
    pub fn mark(&self, name: &str) -> f32 {
        self.worn.get(name).map_or(0.0, |dressed| dressed.subject.mark())
    }

    /// What something wears, for whoever draws it, but for the colour of parts.
    pub(crate) fn worn(&self, name: &str) -> Worn {
        self.worn.get(name).map_or(Worn::NOTHING, |Dressed { slot, subject }| Worn {
            slot: *slot,
            sight: Sight::of(subject.opacity()),
            marked: subject.mark() > 0.0,
            coat: None,
        })
    }

    /// What an impostor wears: how much of it is there, how much it is marked, and the pulse of marks.
    pub(crate) fn of_impostor(&self, name: &str, pulse: f32) -> Vec4 {
        Vec4::new(self.opacity(name), self.mark(name), pulse, 0.0)
    }

    /// Says something of a name, once.
    fn tell(&mut self, what: String) {
        if !self.told.contains(&what) {
            warn!("{what}");
            self.told.insert(what);
        }
    }

    /// What something wears, from now on; none if there is no such thing, or if too many wear something.
    fn dress(&mut self, name: &str, is_known: bool) -> Option<&mut Subject> {
        if !self.worn.contains_key(name) {
            let free = |slot: &u32| self.worn.values().all(|dressed| dressed.slot != *slot);
            match (is_known, (1..SLOTS as u32).find(free)) {
                (false, _) => {
                    self.tell(format!("nothing is called {name}: it can be neither covered nor faded nor marked"));
                    return None;
                }
                (true, None) => {
                    self.tell(format!("{name} stays as it is: {} others are covered, faded or marked already", SLOTS - 1));
                    return None;
                }
                (true, Some(slot)) => {
                    self.worn.insert(name.to_owned(), Dressed { slot, subject: Subject::default() });
                }
            }
        }
        self.worn.get_mut(name).map(|dressed| &mut dressed.subject)
    }
}

/// Covers, fades and marks.
#[derive(Default)]
pub struct CoveringPlugin;

/// The system that settles what is worn in a frame; whoever draws actors comes after it.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct SettleCovers;

impl Plugin for CoveringPlugin {
    fn build(&self, app: &mut App) {
        let told = FrameTold::in_app(app);
        app.init_resource::<Covering>()
            .init_resource::<CoversFrame>()
            .add_plugins(ExtractResourcePlugin::<CoversFrame>::default())
            .add_systems(PostUpdate, told.of("covers", settle).in_set(SettleCovers).after(SettleMoment));
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app.init_resource::<CoversFrame>().init_resource::<CoversGpu>().add_systems(
            Render,
            told.of("covers", gpu::prepare)
                .in_set(RenderSystems::PrepareResources)
                .before(prepare_actors)
                .before(crate::daylight::prepare::receive),
        );
    }
}

/// Who and what is on the stage.
type OnStage<'w> = (Res<'w, Stage>, Res<'w, Actors>, Res<'w, Impostors>, Res<'w, ActorsFrame>);

/// How bright marks are, 0 to 1; brightest as time begins.
pub(crate) fn pulse(time: &Time) -> f32 {
    0.5 + 0.5 * (time.elapsed_secs_wrapped() * TAU / PULSE_S).cos()
}

/// Takes up what was asked for, and goes on with what was begun.
fn settle(
    time: Res<Time>,
    (stage, actors, impostors, actors_frame): OnStage<'_>,
    (now, stage_frame): (Res<Now>, Res<StageFrame>),
    wishes: Option<ResMut<Wishes>>,
    mut covering: ResMut<Covering>,
    mut frame: ResMut<CoversFrame>,
) {
    let covering = &mut *covering;
    if covering.stage != stage.serial() {
        *covering = Covering { stage: stage.serial(), ..Covering::default() };
    }
    let Some(bundle) = stage.bundle() else { return };
    let wished = wishes.filter(|wishes| !wishes.looks.is_empty()).map(|mut wishes| std::mem::take(&mut wishes.looks));
    for wish in wished.into_iter().flatten() {
        match wish {
            Action::Material { target, material, seconds } => {
                match bundle.living().materials.iter().find(|known| known.name == material) {
                    Some(known) => covering.cover(&target, known.clone(), seconds),
                    None => covering.tell(format!("there is no material {material}")),
                }
            }
            Action::Bare { target, seconds } => covering.bare(&target, seconds),
            Action::Fade { what, opacity, seconds } => covering.fade(&what, opacity, seconds),
            Action::Highlight { what, on } => covering.highlight(&what, on),
            _ => {}
        }
    }
    let extents = Extents { stage: &stage, bundle, actors: &actors, looks: &actors_frame };
    let knows = |name: &str| {
        extents.is_part(name)
            || bundle.actors().iter().any(|actor| actor.display_name() == name)
            || actors.whereabouts(name).is_some()
            || impostors.whereabouts(name, &actors).is_some()
    };
    for asked in std::mem::take(&mut covering.asked) {
        match asked {
            Asked::Cover { target, material, seconds } => {
                let begins = covering.beginnings.remove(&target);
                let local_from_world = extents.actor(&target).map_or(Affine3A::IDENTITY, |extent| extent.local_from_world);
                let origin = begins.map(|place| local_from_world.transform_point3(place));
                if let Some(subject) = covering.dress(&target, knows(&target)) {
                    subject.cover(material, origin, seconds);
                }
            }
            Asked::Bare { target, seconds } => {
                if let Some(subject) = covering.dress(&target, knows(&target)) {
                    subject.bare(seconds);
                }
            }
            Asked::Fade { what, opacity, seconds } => {
                if let Some(subject) = covering.dress(&what, knows(&what)) {
                    subject.fade(opacity, seconds);
                }
            }
            Asked::Highlight { what, on } => {
                if let Some(subject) = covering.dress(&what, knows(&what)) {
                    subject.highlight(on);
                }
            }
        }
    }
    let seconds = time.delta_secs();
    covering.worn.values_mut().for_each(|dressed| dressed.subject.pass(seconds));
    covering.worn.retain(|_, dressed| !dressed.subject.is_bare());
    if covering.worn.is_empty() {
        if !frame.slots.is_empty() {
            *frame = CoversFrame { serial: frame.serial + 1, ..CoversFrame::default() };
        }
        return;
    }
    covering.learn_parts(&extents);
    let exposure = stage_frame.exposure_stops.exp2();
    let around = |extent: &Extent| {
        let moment = now.moment.as_ref()?;
        let (low, high) = boxed(extent.local_from_world.inverse(), extent.bounds);
        Some(around(&actors, moment, (low, high)).map(|radiance| radiance * exposure))
    };
    let last = covering.worn.values().map(|dressed| dressed.slot).max().unwrap_or_default();
    let mut slots = vec![CoverUniform::default(); last as usize + 1];
    let mut parts = vec![Worn::NOTHING; bundle.manifest().parts.len()];
    let mut of_actors = [false; 2];
    for (name, Dressed { slot, subject }) in &covering.worn {
        let of_part = covering.parts.1.get(name);
        let extent = of_part.copied().or_else(|| extents.actor(name)).unwrap_or_default();
        let radiance = if subject.shines() { around(&extent) } else { None };
        slots[*slot as usize] = CoverUniform::new(subject, &extent, radiance.unwrap_or_default());
        let matte = subject.coat().filter(|material| material.metal <= 0.0);
        let coat = matte.map(|material| Coat {
            albedo: Vec3::from(material.albedo.map(|v| v as f32)),
            grain: material.grain as f32,
            mean: extent.mean,
        });
        let named = bundle.manifest().parts.iter().zip(&mut parts).filter(|(part, _)| part.name == *name);
        named.for_each(|(_, worn)| *worn = Worn { coat, ..covering.worn(name) });
        if let Some(look) = actors.number(name).and_then(|number| actors_frame.looks.get(number)) {
            look.draws.iter().for_each(|(_, texture)| of_actors[usize::from(texture.is_some())] = true);
        }
    }
    let sun = now.moment.as_ref().filter(|_| now.has_sun);
    let sun_over_pi = sun.map_or(Vec3::ZERO, |moment| moment.shading.sun_irradiance * (exposure * FRAC_1_PI));
    let head = CoversHead {
        sun_direction: sun.map_or(Vec3::Y, |moment| moment.sun_direction).extend(0.0),
        sun_over_pi: sun_over_pi.extend(0.0),
        mark: MARK.extend(pulse(&time)),
    };
    // A part that wears nothing new looks as it did, whatever actors wear.
    let same = frame.parts.iter().eq(&parts);
    let serial = frame.serial + u64::from(!same);
    *frame = CoversFrame { head, slots: slots.into(), parts: parts.into(), actors: of_actors, serial };
}

impl Covering {
    /// Finds out how large parts are and what colours they have, again while more of them comes in.
    fn learn_parts(&mut self, extents: &Extents) {
        let chunks = extents.stage.ground().chunks().len();
        if self.parts.0 != chunks {
            self.parts = (chunks, HashMap::new());
        }
        for name in self.worn.keys() {
            if !self.parts.1.contains_key(name) && extents.is_part(name) {
                self.parts.1.insert(name.clone(), extents.part(name));
            }
        }
    }
}

/// Radiance around a box: on each of its sides as the light is there, a hand off.
fn around(actors: &Actors, moment: &heliodon_bundle::moment::Moment, (low, high): (Vec3, Vec3)) -> [Vec3; 7] {
    let (center, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let mut sides = [Vec3::ZERO; 6];
    for (i, (axis, side)) in AXES.into_iter().zip(&mut sides).enumerate() {
        let mut place = center + axis * (half + AROUND_M);
        // what stands on the ground has nothing below
        place.y = place.y.max(low.y + AROUND_M.min(half.y));
        *side = actors.light_at(moment, place).sky_and_bounce[i];
    }
    Field::new(&sides).terms()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_than_there_is_room_for_wear_anything_and_strangers_nothing() {
        let mut covering = Covering::default();
        assert!(covering.dress("nobody", false).is_none());
        for number in 1..SLOTS {
            covering.dress(&format!("thing {number}"), true).unwrap().highlight(true);
        }
        assert!(covering.dress("one more", true).is_none());
        let mut slots: Vec<u32> = covering.worn.values().map(|dressed| dressed.slot).collect();
        slots.sort_unstable();
        assert!(slots.iter().copied().eq(1..SLOTS as u32), "each has its own");
        // one is bare again, and makes room
        covering.worn.remove("thing 7");
        assert!(covering.dress("one more", true).is_some());
        assert_eq!(covering.told.len(), 2, "told once each");
        assert!(covering.dress("nobody", false).is_none() && covering.told.len() == 2);
    }
}
