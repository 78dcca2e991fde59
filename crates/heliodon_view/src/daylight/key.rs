//! What colour pipelines are specialised for, and the text of their shaders.

use super::pipelines::{VIEW_WGSL, resolved};
use super::texels::{PANORAMA_WGSL, TEXEL_LIGHT_WGSL, TEXELS_WGSL};
use crate::actors::SHADE_WGSL;
use crate::covering::{OUTLINE_WGSL, cover_wgsl};
use crate::detail::{DETAIL_WGSL, VIEWED_WGSL};
use crate::lamps::LAMPS_WGSL;
use crate::tonemap::{DisplayKey, ToneCurve};
use bevy::render::render_resource::TextureFormat;

/// What a colour pipeline is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Subject {
    /// Stone.
    Stone {
        /// Where its colour and its light come from.
        kind: StoneKind,
        /// A body whose backs are left out; otherwise a surface that is seen from both sides, as its material in the bundle says.
        closed: bool,
    },
    /// The dome.
    Sky,
}

/// Where stone's colour and light come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StoneKind {
    /// Both from its vertices.
    Plain,
    /// Light from its vertices, colour from a texture.
    Textured,
    /// Light from texels, colour from a texture, be it a white one.
    Texels,
    /// Both from the panorama where that shows it, else light from its vertices, colour from a texture, be it a white one.
    Panorama,
}

/// All kinds.
pub const KINDS: [StoneKind; 4] = [StoneKind::Plain, StoneKind::Textured, StoneKind::Texels, StoneKind::Panorama];

/// Subjects that are stone.
pub const STONES: usize = 2 * KINDS.len();

/// All subjects; [`Subject::stone_index`] tells where a stone's is, the sky's is the last.
pub const SUBJECTS: [Subject; STONES + 1] = {
    let mut subjects = [Subject::Sky; STONES + 1];
    let mut i = 0;
    while i < STONES {
        subjects[i] = Subject::Stone { kind: KINDS[i / 2], closed: i % 2 == 1 };
        i += 1;
    }
    subjects
};

impl Subject {
    /// Index of a stone's subject in [`SUBJECTS`].
    #[must_use]
    pub fn stone_index(kind: StoneKind, closed: bool) -> usize {
        kind as usize * 2 + usize::from(closed)
    }

    /// Whether it has texture coordinates.
    pub(super) fn textured(self) -> bool {
        matches!(self, Self::Stone { kind: StoneKind::Textured | StoneKind::Texels | StoneKind::Panorama, .. })
    }

    fn by_panorama(self) -> bool {
        matches!(self, Self::Stone { kind: StoneKind::Panorama, .. })
    }

    pub(super) fn by_texels(self) -> bool {
        matches!(self, Self::Stone { kind: StoneKind::Texels, .. })
    }
}

/// What stone is near to that its baked light knows nothing of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Near {
    /// Nothing.
    Nothing,
    /// Actors, which shade it.
    Actors,
    /// Lamps, which light it, and actors.
    Lamps,
}

/// How what a pipeline draws is finished.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Finish {
    /// As it is.
    #[default]
    Bare,
    /// With what it wears ([`crate::covering`]), which its instances name.
    Covered,
    /// Its outline alone.
    Outlined,
}

/// What a colour pipeline is specialised for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PipelineKey {
    pub(super) subject: Subject,
    pub(super) near: Near,
    pub(super) detailed: bool,
    pub(super) finish: Finish,
    pub(super) both_eyes: bool,
    pub(super) display: DisplayKey,
    pub(super) samples: u32,
}

impl PipelineKey {
    /// The key for a target of `format` with `samples` samples.
    #[must_use]
    pub fn new(subject: Subject, curve: ToneCurve, format: TextureFormat, samples: u32) -> Self {
        let display = DisplayKey { curve, format };
        Self { subject, near: Near::Nothing, detailed: false, finish: Finish::Bare, both_eyes: false, display, samples }
    }

    /// The key for stone that is near to something; what that casts is bound as group 1, and the texture is group 2.
    #[must_use]
    pub fn near(self, near: Near) -> Self {
        Self { near: if self.subject == Subject::Sky { Near::Nothing } else { near }, ..self }
    }

    /// The key for stone with a detail, which is the last group.
    #[must_use]
    pub fn detailed(self) -> Self {
        Self { detailed: self.subject != Subject::Sky, ..self }
    }

    /// The key for stone that wears something.
    #[must_use]
    pub fn covered(self) -> Self {
        Self { finish: if self.subject == Subject::Sky { Finish::Bare } else { Finish::Covered }, ..self }
    }

    /// The key for the outlines of all stone on the same target.
    #[must_use]
    pub fn outlined(self) -> Self {
        let subject = Subject::Stone { kind: StoneKind::Plain, closed: true };
        Self { subject, near: Near::Nothing, detailed: false, finish: Finish::Outlined, ..self }
    }

    /// The key for two layers, one for each eye, whose uniforms are an array (multiview.rs).
    #[must_use]
    pub fn both_eyes(self) -> Self {
        Self { both_eyes: true, ..self }
    }

    /// Whether vertices have normals.
    pub(super) fn has_normals(self) -> bool {
        self.near == Near::Lamps || self.detailed || self.finish != Finish::Bare || self.subject.by_texels()
    }

    /// The group of the detail: after the camera's, what casts shade, and the textures.
    fn detail_group(self) -> u32 {
        1 + u32::from(self.near != Near::Nothing) + u32::from(self.subject.textured())
    }

    /// The shader's whole text.
    #[must_use]
    pub fn wgsl(self) -> String {
        let views = [("ONE_VIEW", !self.both_eyes), ("BOTH_EYES", self.both_eyes)];
        let covers = if self.finish == Finish::Bare { String::new() } else { cover_wgsl() };
        let before = format!("{}{}\n{covers}", self.display.wgsl(), resolved(VIEW_WGSL, &views));
        match self.subject {
            Subject::Stone { .. } if self.finish == Finish::Outlined => [before, resolved(OUTLINE_WGSL, &views)].concat(),
            Subject::Stone { .. } => {
                let (shaded, lamps) = (self.near != Near::Nothing, self.near == Near::Lamps);
                let (textured, texels) = (self.subject.textured(), self.subject.by_texels());
                let panorama = self.subject.by_panorama();
                let covered = self.finish == Finish::Covered;
                let defined = [
                    ("TEXTURED", textured),
                    ("PLAIN", !textured),
                    ("TEXELS", texels),
                    ("VERTICES", !texels),
                    ("PANORAMA", panorama),
                    ("SHADED", shaded),
                    ("LAMPS", lamps),
                    ("NORMALS", self.has_normals()),
                    ("PLACED", shaded || self.detailed || covered || panorama),
                    ("COVERED", covered),
                    ("BARE", !covered),
                    ("SUNNED", shaded || covered),
                    ("ALONE", !shaded),
                    ("DETAIL", self.detailed),
                    ("BOTH_EYES", self.both_eyes),
                ];
                let stone = resolved(include_str!("stone.wgsl"), &defined);
                let stone = match (texels, panorama) {
                    (true, _) => format!("{TEXELS_WGSL}{TEXEL_LIGHT_WGSL}{stone}"),
                    (_, true) => format!("{TEXELS_WGSL}{TEXEL_LIGHT_WGSL}{PANORAMA_WGSL}{stone}"),
                    _ => stone,
                };
                let lamps = if lamps { resolved(LAMPS_WGSL, &defined) } else { String::new() };
                let details = match (self.detailed, textured) {
                    (false, _) => String::new(),
                    (true, false) => DETAIL_WGSL.to_owned(),
                    (true, true) => [DETAIL_WGSL, VIEWED_WGSL].concat(),
                };
                let detail = details.replace("DETAIL_GROUP", &self.detail_group().to_string());
                if shaded {
                    [&before, SHADE_WGSL, &lamps, &stone.replace("@group(1)", "@group(2)"), &detail].concat()
                } else {
                    [before, stone, detail].concat()
                }
            }
            Subject::Sky => [before, resolved(crate::sky::SKY_WGSL, &views)].concat(),
        }
    }
}
