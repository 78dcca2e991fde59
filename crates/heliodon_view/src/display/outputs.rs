//! Where pictures are shown: a window for each output, on its monitor where that is there.

use super::compose::Composer;
use super::eyes::RoomEye;
use super::{Room, Side};
use crate::daylight::StereoPair;
use bevy::camera::RenderTarget;
use bevy::camera::visibility::RenderLayers;
use bevy::prelude::*;
use bevy::render::render_resource::{TextureFormat, TextureUsages};
use bevy::render::view::Msaa;
use bevy::window::{Monitor, MonitorSelection, OnMonitor, PrimaryWindow, WindowMode, WindowRef, WindowResolution};
use heliodon_bundle::display::{Display, MonitorName, Output, ScreenEntry, Stereo};

/// Composers come after all eyes' cameras, and text after them.
const COMPOSER_ORDER: isize = 1000;
const HUD_ORDER: isize = 500;

/// A layer on which nothing is: composers draw no entity of the stage.
pub(crate) const NOTHING: usize = 31;

/// What a picture is shown in.
#[derive(Clone, Debug)]
pub enum Showing {
    /// A window.
    Window(Entity),
    /// An image.
    Image(Handle<Image>),
}

impl Showing {
    pub(super) fn target(&self) -> RenderTarget {
        match self {
            Self::Window(window) => RenderTarget::Window(WindowRef::Entity(*window)),
            Self::Image(image) => RenderTarget::from(image.clone()),
        }
    }
}

/// A window that shows a screen.
#[derive(Component, Clone, Debug)]
pub struct ScreenWindow {
    /// The screen's number.
    pub screen: usize,
    output: Output,
    stereo: Stereo,
    eyes: [Handle<Image>; 2],
    overlay: Option<Handle<Image>>,
    /// Its monitor, while it is there.
    monitor: Option<Entity>,
    /// Whether it was told that the monitor is not there.
    told: bool,
}

/// What a screen's windows show: all of it in one, or each eye in its own.
fn outputs(entry: &ScreenEntry) -> Vec<(Output, &'static [Side])> {
    match (&entry.output_right, entry.stereo) {
        (Some(right), Stereo::Pair) => {
            vec![(entry.output.clone(), &[Side::Left]), (right.clone(), &[Side::Right])]
        }
        _ => vec![(entry.output.clone(), Side::of(entry.stereo))],
    }
}

/// Size of an eye's picture for an output of this size.
pub(crate) fn eye_size(stereo: Stereo, [width, height]: [u32; 2]) -> UVec2 {
    match stereo {
        Stereo::SideBySide => UVec2::new(width.div_ceil(2), height),
        Stereo::TopBottom => UVec2::new(width, height.div_ceil(2)),
        _ => UVec2::new(width, height),
    }
    .max(UVec2::ONE)
}

/// A picture to be drawn to and shown.
pub(crate) fn picture(size: UVec2) -> Image {
    let mut image = Image::new_target_texture(size.x, size.y, TextureFormat::Rgba8UnormSrgb, None);
    image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
    image
}

/// The camera of one eye, drawing a picture of its own, which is returned.
pub(crate) fn spawn_eye(world: &mut World, eye: RoomEye, size: UVec2, samples: u32) -> (Entity, Handle<Image>) {
    let image = world.resource_mut::<Assets<Image>>().add(picture(size));
    let order = (eye.screen * 2 + usize::from(eye.side == Side::Right)) as isize;
    let camera = Camera { order, ..default() };
    let entity = world.spawn((eye, camera, Msaa::from_samples(samples), RenderTarget::from(image.clone()))).id();
    if eye.side != Side::Middle {
        // Nothing may be in one eye's picture and not in the other's.
        world.entity_mut(entity).insert(StereoPair(eye.screen as u32));
    }
    (entity, image)
}

/// The camera that brings a screen's pictures to an output.
pub(crate) fn spawn_composer(world: &mut World, composer: Composer, showing: &Showing) -> Entity {
    let camera = Camera { order: COMPOSER_ORDER, clear_color: ClearColorConfig::Custom(Color::BLACK), ..default() };
    let layers = RenderLayers::layer(NOTHING);
    let tone = bevy::core_pipeline::tonemapping::Tonemapping::None;
    world.spawn((Camera3d::default(), tone, Msaa::Off, camera, layers, composer, showing.target())).id()
}

/// The window of an output.
#[must_use]
pub fn window(title: &str, output: &Output) -> Window {
    let [width, height] = output.size_px();
    let mut window = Window {
        title: title.to_owned(),
        name: Some("heliodon".to_owned()),
        resolution: WindowResolution::new(width, height).with_scale_factor_override(1.0),
        ..default()
    };
    if let Some([left, top, ..]) = output.window {
        window.position = WindowPosition::At(IVec2::new(left, top));
        window.decorations = false;
        window.resizable = false;
    }
    window
}

/// The first window of a display, which is the program's own.
#[must_use]
pub fn first_window(title: &str, display: &Display) -> Option<Window> {
    display.screens.first().map(|entry| window(&format!("{title} - {}", entry.name), &entry.output))
}

/// Opens the windows of a room and spawns its cameras. The room's first window is the primary one.
pub(crate) fn open(world: &mut World, room: &Room, title: &str, samples: u32) {
    let mut primary = world.query_filtered::<Entity, With<PrimaryWindow>>().iter(world).next();
    let hud = room.display().display.hud.clone();
    for (number, entry) in room.display().screens.iter().enumerate() {
        let has_hud = hud.as_ref().map_or(number == 0, |name| *name == entry.name);
        // Where both eyes' pictures are shown, text lies over both; where one is, it is drawn over it at once, so that the mouse reaches it.
        let size = eye_size(entry.stereo, entry.output.size_px());
        let overlay = (has_hud && entry.stereo.is_double()).then(|| {
            let image = world.resource_mut::<Assets<Image>>().add(picture(size));
            let camera = Camera { order: HUD_ORDER, clear_color: ClearColorConfig::Custom(Color::NONE), ..default() };
            let layers = RenderLayers::layer(NOTHING);
            let tone = bevy::core_pipeline::tonemapping::Tonemapping::None;
            world.spawn((
                Camera3d::default(),
                tone,
                Msaa::Off,
                camera,
                layers,
                IsDefaultUiCamera,
                RenderTarget::from(image.clone()),
            ));
            image
        });
        for (output, sides) in outputs(entry) {
            let of = |world: &mut World, side: Side| {
                let size = eye_size(entry.stereo, output.size_px());
                spawn_eye(world, RoomEye { screen: number, side }, size, samples).1
            };
            let eyes: Vec<Handle<Image>> = sides.iter().map(|&side| of(world, side)).collect();
            let [Some(first), Some(last)] = [eyes.first(), eyes.last()] else { continue };
            let eyes = [first.clone(), last.clone()];
            let shown = primary.take().unwrap_or_else(|| {
                let suffix = if entry.stereo == Stereo::Pair { sides[0].suffix() } else { "" };
                world.spawn(window(&format!("{title} - {}{suffix}", entry.name), &output)).id()
            });
            let composer = Composer::new(entry, eyes.clone(), overlay.clone());
            let camera = spawn_composer(world, composer, &Showing::Window(shown));
            if has_hud && overlay.is_none() {
                world.entity_mut(camera).insert(IsDefaultUiCamera);
            }
            let stereo = entry.stereo;
            world.entity_mut(shown).insert(ScreenWindow {
                screen: number,
                output,
                stereo,
                eyes,
                overlay: overlay.clone(),
                monitor: None,
                told: false,
            });
        }
    }
}

/// The monitor of a name among those that are there, sorted by where they are: from the left, then from above.
fn find<'a>(monitors: &[(Entity, &'a Monitor)], name: &MonitorName) -> Option<(Entity, &'a Monitor)> {
    match name {
        MonitorName::Number(number) => monitors.get((*number as usize).checked_sub(1)?).copied(),
        MonitorName::Name(name) => monitors.iter().find(|(_, monitor)| monitor.name.as_ref() == Some(name)).copied(),
    }
}

/// What monitors there are, for people.
fn listed(monitors: &[(Entity, &Monitor)]) -> String {
    let each = monitors.iter().enumerate().map(|(number, (_, monitor))| {
        let name = monitor.name.as_deref().unwrap_or("without a name");
        format!("{} ({name}, {} x {})", number + 1, monitor.physical_width, monitor.physical_height)
    });
    match monitors.is_empty() {
        true => "there are none".to_owned(),
        false => format!("there are {}", each.collect::<Vec<_>>().join(", ")),
    }
}

/// Bevy despawns a monitor that was unplugged, and with it the windows that it knows to be there, the program's own included. What
/// is not known to be there stays.
pub(super) fn keep_windows(put: On<Insert, OnMonitor>, mut commands: Commands) {
    commands.entity(put.event_target()).remove::<OnMonitor>();
}

/// Puts windows onto their monitors when those come, keeps them when those go, and makes pictures as large as their windows.
pub(super) fn follow_monitors(
    room: Res<Room>,
    monitors: Query<(Entity, &Monitor)>,
    mut windows: Query<(&mut Window, &mut ScreenWindow)>,
    mut images: ResMut<Assets<Image>>,
) {
    let mut there: Vec<(Entity, &Monitor)> = monitors.iter().collect();
    there.sort_by_key(|(_, monitor)| (monitor.physical_position.x, monitor.physical_position.y));
    for (mut window, mut shown) in &mut windows {
        if let Some(name) = &shown.output.monitor {
            let found = find(&there, name);
            if found.map(|(entity, _)| entity) != shown.monitor {
                shown.monitor = found.map(|(entity, _)| entity);
                window.mode = match found {
                    Some((entity, _)) => WindowMode::BorderlessFullscreen(MonitorSelection::Entity(entity)),
                    None => WindowMode::Windowed,
                };
            }
            // Monitors are listed a few frames after the program began; without any there is nothing to tell yet.
            if shown.monitor.is_none() && !shown.told && !there.is_empty() {
                shown.told = true;
                let screen = room.display().screens.get(shown.screen).map_or("", |entry| entry.name.as_str());
                let name = match &shown.output.monitor {
                    Some(MonitorName::Name(name)) => format!("`{name}`"),
                    Some(MonitorName::Number(number)) => number.to_string(),
                    None => String::new(),
                };
                error!("there is no monitor {name}, {}; screen `{screen}` is shown in a window", listed(&there));
            }
        }
        let size = eye_size(shown.stereo, [window.physical_width(), window.physical_height()]);
        for handle in shown.eyes.iter().chain(&shown.overlay) {
            if images.get(handle).is_some_and(|image| image.size() != size) {
                // A picture of no size is of a window that is just being closed.
                images.insert(handle.id(), picture(size)).ok();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_bundle::display::Preset;

    fn monitor(name: &str, x: i32) -> Monitor {
        Monitor {
            name: Some(name.to_owned()),
            physical_height: 768,
            physical_width: 1024,
            physical_position: IVec2::new(x, 0),
            refresh_rate_millihertz: None,
            scale_factor: 1.0,
            video_modes: Vec::new(),
        }
    }

    #[test]
    fn windows_go_to_their_monitors_and_come_back() {
        let mut display = Preset::Cave.file();
        display.screens.truncate(1);
        display.screens[0].output = Output { monitor: Some(MonitorName::Name("B".to_owned())), ..Output::default() };
        let room = Room::new(Display::parse(&display.to_toml_string(), "display.toml").unwrap().into()).unwrap();
        let mut app = App::new();
        app.init_resource::<Assets<Image>>()
            .insert_resource(room.clone())
            .add_observer(keep_windows)
            .add_systems(Update, follow_monitors);
        app.world_mut().spawn((Window::default(), PrimaryWindow));
        open(app.world_mut(), &room, "test", 1);
        let mode =
            |app: &mut App| app.world_mut().query_filtered::<&Window, With<ScreenWindow>>().single(app.world()).unwrap().mode;
        app.update();
        assert_eq!(mode(&mut app), WindowMode::Windowed);
        app.world_mut().spawn(monitor("A", 0));
        let wanted = app.world_mut().spawn(monitor("B", 1024)).id();
        app.update();
        assert_eq!(mode(&mut app), WindowMode::BorderlessFullscreen(MonitorSelection::Entity(wanted)));
        // As Bevy does it.
        let window = app.world_mut().query_filtered::<Entity, With<ScreenWindow>>().single(app.world()).unwrap();
        app.world_mut().entity_mut(window).insert(OnMonitor(wanted));
        app.world_mut().despawn(wanted);
        app.update();
        assert_eq!(mode(&mut app), WindowMode::Windowed);
        // The eyes' pictures are as large as what the window shows of them.
        let shown = app.world_mut().query::<(&Window, &ScreenWindow)>().single(app.world()).unwrap();
        let (size, eyes) = (shown.0.physical_size(), shown.1.eyes.clone());
        let image = app.world().resource::<Assets<Image>>().get(&eyes[1]).unwrap();
        assert_eq!(image.size(), UVec2::new(size.x, size.y.div_ceil(2)));
    }

    #[test]
    fn monitors_are_counted_from_the_left() {
        let (a, b) = (monitor("A", 1024), monitor("B", 0));
        let there = [(Entity::PLACEHOLDER, &b), (Entity::PLACEHOLDER, &a)];
        let name = |found: Option<(Entity, &Monitor)>| found.and_then(|(_, monitor)| monitor.name.clone());
        assert_eq!(name(find(&there, &MonitorName::Number(1))).as_deref(), Some("B"));
        assert_eq!(name(find(&there, &MonitorName::Name("A".to_owned()))).as_deref(), Some("A"));
        assert!(find(&there, &MonitorName::Number(3)).is_none() && find(&there, &MonitorName::Number(0)).is_none());
    }
}
