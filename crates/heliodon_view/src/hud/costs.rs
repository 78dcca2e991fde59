//! What each feature takes of the processor, under the text in the corner.

use super::panel::{TELL_EVERY_S, text};
use super::{FAINT, HudVisibility};
use crate::costs::{Cost, FrameTold};
use bevy::prelude::*;

/// Less is not told, milliseconds: it is 0.0 in a digit after the point.
const LEAST_MS: f32 = 0.05;

/// The block.
#[derive(Component)]
pub(super) struct CostText;

/// The block, not shown.
pub(super) fn block() -> impl Bundle {
    let node = Node { display: Display::None, margin: UiRect::top(px(6)), ..default() };
    (CostText, node, text(13.0, FAINT))
}

/// Shows the block or takes it away, and tells it anew now and then.
pub(super) fn tell(
    time: Res<Time<Real>>,
    visibility: Res<HudVisibility>,
    told: Option<Res<FrameTold>>,
    mut blocks: Query<(&mut Text, &mut Node), With<CostText>>,
    mut since_s: Local<f32>,
) {
    *since_s += time.delta_secs();
    let Some(told) = told else { return };
    let display = if visibility.costs { Display::Flex } else { Display::None };
    for (mut text, mut node) in &mut blocks {
        let appears = node.display != display;
        if appears {
            node.display = display;
        }
        if visibility.costs && (appears || *since_s >= TELL_EVERY_S) {
            text.set_if_neq(Text(lines(&told.costs())));
        }
    }
    if *since_s >= TELL_EVERY_S {
        *since_s = 0.0;
    }
}

/// A line for each feature, and what they take together: on several cores at once, so that it may be more than the frame.
fn lines(costs: &[(&'static str, Cost)]) -> String {
    // the sum of nothing is -0.0
    let sum = costs.iter().fold(0.0, |sum, (_, cost)| sum + cost.smoothed_ms);
    let told = costs.iter().filter(|(_, cost)| cost.peak_ms >= LEAST_MS);
    let lines = told.map(|(name, cost)| format!("{name:<10}{:4.1} ms, up to {:.1}", cost.smoothed_ms, cost.peak_ms));
    let sum = format!("{:<10}{sum:4.1} ms of the processor", "together");
    lines.chain([sum]).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn app() -> App {
        let mut app = App::new();
        FrameTold::in_app(&mut app);
        app.init_resource::<HudVisibility>().init_resource::<Time<Real>>().add_systems(Update, tell);
        app.world_mut().spawn(block());
        app
    }

    fn shown(app: &mut App) -> Option<String> {
        app.update();
        let world = app.world_mut();
        let (text, node) = world.query::<(&Text, &Node)>().single(world).unwrap();
        (node.display == Display::Flex).then(|| text.0.clone())
    }

    #[test]
    fn the_block_comes_and_goes_and_says_what_there_is() {
        let mut app = app();
        assert_eq!(shown(&mut app), None);
        app.world_mut().resource_mut::<HudVisibility>().costs = true;
        assert_eq!(shown(&mut app).unwrap(), "together   0.0 ms of the processor");
        app.world_mut().resource_mut::<HudVisibility>().costs = false;
        assert_eq!(shown(&mut app), None);
    }

    #[test]
    fn what_takes_nothing_is_left_out() {
        let cost = |smoothed_ms, peak_ms| Cost { smoothed_ms, peak_ms, ..Cost::default() };
        let costs = [("story", cost(0.4, 1.2)), ("lamps", cost(0.0, 0.01)), ("actors", cost(12.5, 15.0))];
        let wanted = "story      0.4 ms, up to 1.2\nactors    12.5 ms, up to 15.0\ntogether  12.9 ms of the processor";
        assert_eq!(lines(&costs), wanted);
    }
}
