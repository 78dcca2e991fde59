//! What a visitor is told: the task that stands, hints and subtitles for a while, a darkened picture.

use super::letters::Lettered;
use bevy::prelude::*;

const INK: Color = Color::srgb(0.97, 0.96, 0.93);
const TASK_INK: Color = Color::srgb(1.0, 0.88, 0.6);
const PANEL: Color = Color::srgba(0.04, 0.04, 0.05, 0.72);
/// How many subtitles wait for their turn.
const MOST_WAITING: usize = 8;
/// What a subtitle without a length of its own stands for: a moment, and what reading takes, seconds.
const STANDS_S: f32 = 1.5;
const READ_S: f32 = 0.06;

/// What is told at the moment.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct Board {
    /// What to do next.
    pub task: Option<String>,
    hint: Option<(String, f32)>,
    /// What is said, one after the other, each with the seconds that are left of it.
    said: std::collections::VecDeque<(String, f32)>,
    darkness: f32,
    /// What it becomes, and in how many seconds.
    darkens: (f32, f32),
}

impl Board {
    /// Says something, after what is being said.
    pub fn say(&mut self, text: String, seconds: f32) {
        if self.said.len() == MOST_WAITING {
            // who floods the visitor is heard last
            self.said.pop_back();
        }
        let seconds = lasting(&text, seconds);
        self.said.push_back((text, seconds));
    }

    /// Helps for a while.
    pub fn hint(&mut self, text: String, seconds: f32) {
        let seconds = lasting(&text, seconds);
        self.hint = Some((text, seconds));
    }

    /// Darkens the picture, or clears it.
    pub fn fade(&mut self, darkness: f32, seconds: f32) {
        self.darkens = (darkness.clamp(0.0, 1.0), seconds.max(0.0));
    }

    /// What is said now.
    #[must_use]
    pub fn subtitle(&self) -> Option<&str> {
        self.said.front().map(|(text, _)| text.as_str())
    }

    fn pass(&mut self, seconds: f32) {
        let left = self.said.front_mut().map(|(_, left_s)| {
            *left_s -= seconds;
            *left_s
        });
        if left.is_some_and(|left_s| left_s <= 0.0) {
            self.said.pop_front();
        }
        self.hint = self.hint.take().map(|(text, left_s)| (text, left_s - seconds)).filter(|(_, left_s)| *left_s > 0.0);
        let (becomes, in_s) = self.darkens;
        let share = if in_s > seconds { seconds / in_s } else { 1.0 };
        self.darkness += (becomes - self.darkness) * share;
        self.darkens.1 = (in_s - seconds).max(0.0);
    }
}

fn lasting(text: &str, seconds: f32) -> f32 {
    if seconds > 0.0 { seconds } else { STANDS_S + READ_S * text.chars().count() as f32 }
}

/// What of the board a text shows.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Line {
    Task,
    Hint,
    Subtitle,
}

/// The dark before the picture.
#[derive(Component)]
pub(super) struct Dark;

pub(super) fn spawn(mut commands: Commands) {
    let whole = Node { position_type: PositionType::Absolute, width: percent(100), height: percent(100), ..default() };
    commands.spawn((Dark, whole, BackgroundColor(Color::NONE), GlobalZIndex(-1)));
    // above the timeline, where neither text nor help stand
    let column = Node {
        position_type: PositionType::Absolute,
        bottom: percent(13),
        width: percent(100),
        flex_direction: FlexDirection::Column,
        align_items: AlignItems::Center,
        row_gap: px(6),
        padding: UiRect::horizontal(percent(12)),
        ..default()
    };
    let line = |line: Line, size: f32, color: Color| {
        let node = Node { padding: UiRect::axes(px(14), px(7)), border_radius: BorderRadius::all(px(6)), ..default() };
        let text = (Text::default(), TextFont::from_font_size(size), TextColor(color), TextLayout::justify(Justify::Center));
        (line, Lettered, Visibility::Hidden, BackgroundColor(PANEL), node, text)
    };
    commands.spawn(column).with_children(|parent| {
        parent.spawn(line(Line::Subtitle, 22.0, INK));
        parent.spawn(line(Line::Hint, 17.0, TASK_INK));
        parent.spawn(line(Line::Task, 20.0, TASK_INK));
    });
}

/// Lets time pass over the board, and shows it.
pub(super) fn show(
    time: Res<Time>,
    mut board: ResMut<Board>,
    mut lines: Query<(&Line, &mut Text, &mut Visibility)>,
    mut dark: Query<&mut BackgroundColor, With<Dark>>,
) {
    if *board == Board::default() && lines.iter().all(|(_, _, visibility)| *visibility == Visibility::Hidden) {
        return;
    }
    board.pass(time.delta_secs());
    for (line, mut text, mut visibility) in &mut lines {
        let shown = match line {
            Line::Task => board.task.as_deref(),
            Line::Hint => board.hint.as_ref().map(|(text, _)| text.as_str()),
            Line::Subtitle => board.subtitle(),
        };
        if text.0 != shown.unwrap_or_default() {
            text.0 = shown.unwrap_or_default().to_owned();
        }
        visibility.set_if_neq(if shown.is_some() { Visibility::Inherited } else { Visibility::Hidden });
    }
    for mut color in &mut dark {
        color.set_if_neq(BackgroundColor(Color::BLACK.with_alpha(board.darkness)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_is_said_in_turn() {
        let mut board = Board::default();
        board.say("one".into(), 1.0);
        board.say("two".into(), 0.0);
        assert_eq!(board.subtitle(), Some("one"));
        board.pass(1.0);
        assert_eq!(board.subtitle(), Some("two"));
        board.pass(STANDS_S + 4.0 * READ_S);
        assert_eq!(board.subtitle(), None);
        (0..100).for_each(|i| board.say(i.to_string(), 1.0));
        assert_eq!(board.said.len(), MOST_WAITING);
    }

    #[test]
    fn a_picture_darkens_in_its_time() {
        let mut board = Board::default();
        board.fade(1.0, 2.0);
        (0..10).for_each(|_| board.pass(0.1));
        assert!((board.darkness - 0.5).abs() < 1e-3, "{}", board.darkness);
        (0..11).for_each(|_| board.pass(0.1));
        assert_eq!(board.darkness, 1.0);
        board.fade(0.0, 0.0);
        board.pass(0.01);
        assert_eq!(board.darkness, 0.0);
    }
}
