//! The board's letters: Latin, Greek with accents and breathings, and Cyrillic come with the viewer; a story may bring a font of its own for others.
//!
//! Bevy's own font has Latin alone. Noto Sans, reduced to what is named above, takes 193 kB; whole it is three times that, and every script that it has not
//! (Arabic, Georgian, Chinese) wants a font of its own anyway.

use bevy::prelude::*;
use heliodon_bundle::BundleReader;
use heliodon_bundle::site::is_font;

/// Noto Sans, under the SIL Open Font License (`OFL.txt` beside it).
const LETTERS: &[u8] = include_bytes!("NotoSans-Regular.ttf");

/// A text that is shown in the board's letters.
#[derive(Component, Clone, Copy, Debug, Default)]
pub struct Lettered;

/// The fonts of the board.
#[derive(Resource, Default)]
pub struct Letters {
    /// The viewer's own.
    own: Option<Handle<Font>>,
    /// The story's.
    story: Option<Handle<Font>>,
    /// Whether another is to be put on the board.
    changed: bool,
}

impl Letters {
    /// Takes up the font of a bundle's story, or the viewer's own.
    pub(super) fn open(&mut self, bundle: Option<&BundleReader>, fonts: Option<&mut Assets<Font>>) {
        let Some(fonts) = fonts else { return };
        if self.own.is_none() {
            self.own = Some(fonts.add(Font::from_bytes(LETTERS.to_vec())));
        }
        self.story = bundle.and_then(|bundle| {
            let name = bundle.living().story.as_ref()?.font.as_ref()?;
            let read = std::fs::read(bundle.folder().join(name)).map_err(|error| error.to_string());
            let font = read.and_then(|bytes| if is_font(&bytes) { Ok(bytes) } else { Err("it is no font".to_owned()) });
            let bytes = font.map_err(|why| warn!("texts are shown in the viewer's own letters: {name}: {why}")).ok()?;
            Some(fonts.add(Font::from_bytes(bytes)))
        });
        self.changed = true;
    }
}

/// Puts the font on the board.
pub(super) fn put(mut letters: ResMut<Letters>, mut lines: Query<&mut TextFont, With<Lettered>>) {
    let Some(font) = letters.story.as_ref().or(letters.own.as_ref()).filter(|_| letters.changed).cloned() else { return };
    lines.iter_mut().for_each(|mut line| line.font = font.clone().into());
    letters.changed = false;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_letters_are_a_font() {
        assert!(is_font(LETTERS) && !is_font(b"letters"));
    }
}
