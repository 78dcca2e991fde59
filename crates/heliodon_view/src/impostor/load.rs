//! Reading the bundle's impostors, on a thread of its own.

use super::Person;
use crate::actors::course::Course;
use crate::lamps::reaching::Reach;
use bevy::math::{DVec3, Vec3};
use heliodon_bundle::BundleReader;
use heliodon_bundle::impostor::{Impostor, ImpostorInfo};
use heliodon_bundle::site::Actor;
use heliodon_math::random::Pcg32;
use std::collections::BTreeMap;
use std::sync::Arc;

/// How much slower or faster than another somebody of several walks.
const PACE: f32 = 0.12;

/// The bundle's impostors.
#[derive(Default)]
pub struct Loaded {
    /// What they look like, each once.
    pub kinds: Vec<Arc<Kind>>,
    /// All of them.
    pub people: Vec<Person>,
    /// What could not be read, and why.
    pub failures: Vec<String>,
}

/// An impostor.
#[derive(Debug)]
pub struct Kind {
    /// With its texels.
    pub impostor: Impostor,
    /// Of its views: right, up, and towards the view.
    axes: Vec<[Vec3; 3]>,
}

impl Kind {
    /// An impostor, ready to be asked for its views.
    #[must_use]
    pub fn new(impostor: Impostor) -> Self {
        let axes = impostor.info.view_axes().collect();
        Self { impostor, axes }
    }

    /// What it is.
    #[must_use]
    pub fn info(&self) -> &ImpostorInfo {
        &self.impostor.info
    }

    /// The view nearest to a direction from the model's middle, and that one's own.
    #[must_use]
    pub fn nearest(&self, toward: Vec3) -> (u32, Vec3) {
        let views = self.axes.iter().zip(0..).map(|([_, _, own], view)| (view, *own));
        views.max_by(|a, b| a.1.dot(toward).total_cmp(&b.1.dot(toward))).unwrap_or((0, Vec3::Z))
    }
}

/// Reads them all; what fails is told, and the others are there.
pub fn run(bundle: &BundleReader) -> Loaded {
    let mut loaded = Loaded::default();
    let mut known: BTreeMap<&str, Result<usize, String>> = BTreeMap::new();
    for actor in bundle.actors().iter().filter(|actor| actor.is_impostor()) {
        let kind = known.entry(&actor.file).or_insert_with(|| {
            loaded.kinds.push(Arc::new(Kind::new(read(bundle, &actor.file)?)));
            Ok(loaded.kinds.len() - 1)
        });
        match kind {
            Ok(kind) => loaded.people.extend(people(loaded.kinds[*kind].info(), actor, *kind)),
            Err(what) => loaded.failures.push(format!("the actor {} is missing: {what}", actor.display_name())),
        }
    }
    loaded
}

fn read(bundle: &BundleReader, file: &str) -> Result<Impostor, String> {
    let bytes = std::fs::read(bundle.folder().join(file)).map_err(|error| format!("{file}: {error}"))?;
    Impostor::from_bytes(&bytes, file).map_err(|error| error.to_string())
}

/// Everybody that an actor stands for, each on one of its ways, somewhere along it, with a pace and a phase of their own.
pub fn people(info: &ImpostorInfo, actor: &Actor, kind: usize) -> Vec<Person> {
    let clip = actor.animation.as_ref().and_then(|name| info.clips.iter().position(|clip| clip.name == *name)).unwrap_or(0);
    let turn = (actor.turn_deg as f32).to_radians();
    let ways: Vec<Vec<Vec3>> =
        actor.ways().iter().map(|way| way.iter().map(|&point| DVec3::from(point).as_vec3()).collect()).collect();
    let mut random = Pcg32::new(u64::from(actor.seed), 0xc20d);
    (0..actor.count as usize)
        .filter_map(|number| {
            let way = ways.get(number % ways.len().max(1))?.clone();
            let several = actor.count > 1;
            let mut among = |low: f32, high: f32| if several { random.range_f32(low, high) } else { 0.5 * (low + high) };
            let pace = among(1.0 - PACE, 1.0 + PACE);
            let (length, stands) = (way.windows(2).map(|pair| pair[0].distance(pair[1])).sum::<f32>(), way.len() < 2);
            // who stands among others looks anywhere
            let turn = if stands && several { turn + among(-std::f32::consts::PI, std::f32::consts::PI) } else { turn };
            let course = Course::walks(way, actor.walk_speed as f32 * pace, actor.walk, turn);
            // There and back, or round.
            let ahead_s = if several { among(0.0, 2.0) * length / (actor.walk_speed as f32 * pace) } else { 0.0 };
            let phase_s = if several { among(0.0, 60.0) } else { 0.0 };
            Some(Person {
                name: actor.display_name().into(),
                kind,
                clip,
                course,
                ahead_s,
                speed: actor.speed as f32 * pace,
                phase_s,
                scale: actor.scale as f32,
                reach: Reach::default(),
            })
        })
        .collect()
}
