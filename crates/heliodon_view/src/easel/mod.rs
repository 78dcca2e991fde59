//! A window for tools: a picture that somebody else makes, text beside it, and the keys and the mouse given on.
//!
//! For what is looked at texel by texel while it is adjusted, as the frames of an impostor are. The picture is shown by whole multiples of its size, so that texels
//! stay squares; there is no stage and no sky.

use bevy::asset::RenderAssetUsages;
use bevy::image::{ImageSampler, TextureFormatPixelInfo};
use bevy::input::ButtonState;
use bevy::input::keyboard::{Key, KeyboardInput};
use bevy::input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll};
use bevy::log::{Level, LogPlugin};
use bevy::prelude::*;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
use bevy::window::{ExitCondition, PrimaryWindow, WindowResolution};
use heliodon_image::SrgbImage;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use thiserror::Error;

const GROUND: Color = Color::srgb(0.13, 0.13, 0.14);
const INK: Color = Color::srgb(0.92, 0.91, 0.88);
/// What the text takes of the window's width, logical pixels.
const TEXT_PX: f32 = 330.0;
const MARGIN_PX: f32 = 16.0;

/// A key that goes down.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Press {
    /// One with a sign on it.
    Sign(String),
    /// The arrows.
    Left,
    /// To the right.
    Right,
    /// Upwards.
    Up,
    /// Downwards.
    Down,
    /// Done.
    Enter,
    /// Given up.
    Escape,
}

impl Press {
    fn of(key: &Key) -> Option<Self> {
        Some(match key {
            Key::Character(sign) => Self::Sign(sign.to_string()),
            Key::ArrowLeft => Self::Left,
            Key::ArrowRight => Self::Right,
            Key::ArrowUp => Self::Up,
            Key::ArrowDown => Self::Down,
            Key::Enter => Self::Enter,
            Key::Escape => Self::Escape,
            Key::Space => Self::Sign(" ".to_owned()),
            _ => return None,
        })
    }
}

/// What is on an easel.
pub trait Work: Send + 'static {
    /// Its picture, where it has changed since it was asked for last.
    fn picture(&mut self) -> Option<SrgbImage>;
    /// What is told beside it, in lines.
    fn told(&self) -> String;
    /// A key goes down; with Shift.
    fn press(&mut self, key: &Press, shift: bool);
    /// The mouse moves so many of the picture's pixels with its button down, to the right and down.
    fn drag(&mut self, by: [f32; 2]);
    /// The wheel turns so many notches away from whoever sits before it.
    fn turn(&mut self, notches: f32);
    /// Time passes, seconds.
    fn pass(&mut self, seconds: f32);
    /// Whether the window may close.
    fn is_done(&self) -> bool;
}

/// Why a window ended badly.
#[derive(Debug, Error)]
pub enum EaselError {
    /// Bevy ended with an error.
    #[error("the window ended with error {0}; set RUST_LOG=info to see what came before")]
    Ended(u8),
}

#[derive(Resource)]
struct Easel<W: Work>(Arc<Mutex<W>>);

impl<W: Work> Easel<W> {
    fn work(&self) -> MutexGuard<'_, W> {
        // whoever panicked has ended the program anyway
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Where the picture is shown, and by how many pixels one of its own.
#[derive(Component, Clone, Copy, Debug, Default)]
struct Canvas {
    size: [u32; 2],
    scale: f32,
}

#[derive(Component)]
struct Told;

/// Shows a work until it is done or its window is closed, and gives it back through `work`.
///
/// # Errors
/// If the window ends with an error.
///
/// # Panics
/// Without a display or without any Vulkan, Metal or DirectX driver, as Bevy does.
pub fn show<W: Work>(title: &str, size: (u32, u32), work: &Arc<Mutex<W>>) -> Result<(), EaselError> {
    let window = Window {
        title: title.to_owned(),
        name: Some("heliodon".to_owned()),
        resolution: WindowResolution::new(size.0, size.1),
        ..default()
    };
    let mut app = App::new();
    app.add_plugins(
        DefaultPlugins
            .set(crate::visit::graphics())
            .set(WindowPlugin { primary_window: Some(window), exit_condition: ExitCondition::OnPrimaryClosed, ..default() })
            .set(LogPlugin { level: Level::WARN, filter: crate::visit::LOG_FILTER.to_owned(), ..default() }),
    );
    add::<W>(&mut app, work);
    match app.run() {
        AppExit::Success => Ok(()),
        AppExit::Error(code) => Err(EaselError::Ended(code.get())),
    }
}

fn add<W: Work>(app: &mut App, work: &Arc<Mutex<W>>) {
    app.insert_resource(Easel(Arc::clone(work)))
        .insert_resource(ClearColor(GROUND))
        .add_systems(Startup, spawn)
        .add_systems(Update, (give_on::<W>, paint::<W>, fit).chain());
}

fn spawn(mut commands: Commands) {
    commands.spawn(Camera2d);
    let canvas = Node { position_type: PositionType::Absolute, ..default() };
    commands.spawn((Canvas::default(), canvas, ImageNode::default()));
    let text = Node {
        position_type: PositionType::Absolute,
        top: px(MARGIN_PX),
        right: px(MARGIN_PX),
        width: px(TEXT_PX - 2.0 * MARGIN_PX),
        ..default()
    };
    commands.spawn((Told, text, Text::default(), TextFont::from_font_size(14.0), TextColor(INK)));
}

/// Gives keys and mouse on.
fn give_on<W: Work>(
    time: Res<Time<Real>>,
    mut typed: MessageReader<KeyboardInput>,
    (keys, buttons): (Res<ButtonInput<KeyCode>>, Res<ButtonInput<MouseButton>>),
    (motion, scroll): (Res<AccumulatedMouseMotion>, Res<AccumulatedMouseScroll>),
    easel: Res<Easel<W>>,
    canvas: Query<&Canvas>,
    mut exit: MessageWriter<AppExit>,
) {
    let mut work = easel.work();
    let shift = keys.any_pressed([KeyCode::ShiftLeft, KeyCode::ShiftRight]);
    for key in typed.read().filter(|key| key.state == ButtonState::Pressed) {
        Press::of(&key.logical_key).iter().for_each(|press| work.press(press, shift));
    }
    let scale = canvas.iter().map(|canvas| canvas.scale).fold(0.0, f32::max);
    if buttons.pressed(MouseButton::Left) && motion.delta != Vec2::ZERO && scale > 0.0 {
        work.drag((motion.delta / scale).to_array());
    }
    let notches = crate::input::notches(&scroll);
    if notches != 0.0 {
        work.turn(notches);
    }
    work.pass(time.delta_secs());
    if work.is_done() {
        exit.write(AppExit::Success);
    }
}

/// Takes up picture and text.
fn paint<W: Work>(
    easel: Res<Easel<W>>,
    mut images: ResMut<Assets<Image>>,
    mut canvas: Query<(&mut Canvas, &mut ImageNode)>,
    mut told: Query<&mut Text, With<Told>>,
) {
    let mut work = easel.work();
    for mut text in &mut told {
        text.set_if_neq(Text(work.told()));
    }
    let Some(picture) = work.picture() else { return };
    let format = TextureFormat::Rgba8UnormSrgb;
    let size = Extent3d { width: picture.width, height: picture.height, depth_or_array_layers: 1 };
    let bytes: Vec<u8> = picture.pixels.iter().flatten().copied().collect();
    debug_assert_eq!(
        Some(bytes.len()),
        format.pixel_size().ok().map(|pixel| size.width as usize * size.height as usize * pixel)
    );
    let mut image = Image::new(size, TextureDimension::D2, bytes, format, RenderAssetUsages::RENDER_WORLD);
    image.sampler = ImageSampler::nearest();
    for (mut canvas, mut node) in &mut canvas {
        canvas.size = [picture.width, picture.height];
        node.image = images.add(image.clone());
    }
}

/// Keeps the picture as large as whole multiples allow, in the middle of what the text leaves.
fn fit(windows: Query<&Window, With<PrimaryWindow>>, mut canvas: Query<(&mut Canvas, &mut Node)>) {
    let Some(window) = windows.iter().next() else { return };
    for (mut canvas, mut node) in &mut canvas {
        let [width, height] = canvas.size.map(|side| side as f32);
        if width * height == 0.0 {
            continue;
        }
        let room = Vec2::new(window.width() - TEXT_PX - MARGIN_PX, window.height() - 2.0 * MARGIN_PX);
        let scale = (room.x / width).min(room.y / height);
        let scale = if scale >= 1.0 { scale.floor() } else { scale.max(1.0 / 64.0) };
        let corner = (0.5 * (room - scale * Vec2::new(width, height)) + MARGIN_PX).max(Vec2::ZERO).floor();
        if canvas.scale != scale || node.left != px(corner.x) || node.top != px(corner.y) || node.width != px(width * scale) {
            canvas.scale = scale;
            (node.left, node.top) = (px(corner.x), px(corner.y));
            (node.width, node.height) = (px(width * scale), px(height * scale));
        }
    }
}
