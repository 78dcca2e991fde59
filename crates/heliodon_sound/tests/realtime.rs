//! The audio thread neither allocates nor frees, whatever it is told while it renders.
#![expect(unsafe_code, reason = "an allocator that counts")]

use glam::{Quat, Vec3};
use heliodon_sound::feed::feed;
use heliodon_sound::room::{Room, Walls};
use heliodon_sound::{Clip, Content, DayCurve, MixerSettings, RATE_HZ, SourceSettings};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

thread_local! {
    static COUNTED: Cell<Option<u64>> = const { Cell::new(None) };
}

struct Counting;

fn count() {
    // no thread-local value any more: the thread is ending, and nothing is counted
    let _ = COUNTED.try_with(|counted| counted.set(counted.get().map(|count| count + 1)));
}

// SAFETY: everything is handed on to the system's allocator as it came; counting neither allocates nor unwinds.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's layout, unchanged
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count();
        // SAFETY: what `alloc` handed out, with its layout
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn rendering_neither_allocates_nor_frees() {
    let (mut control, mut mixer) = MixerSettings { sources: 300, voices: 20, reflected: 4 }.build();
    let blip = Arc::new(Clip::new((0..9000).map(|k| (k as f32 * 0.1).sin() * 0.2).collect(), 1).expect("a clip"));
    let room = |side: f32| Room::with_walls("hall", Vec3::splat(-side), Vec3::splat(side), Walls::Stone);
    let (mut writer, reader) = feed(44_100, 2, 1.0).expect("a feed");
    control.add(Content::Feed(Box::new(reader)), &SourceSettings::default()).expect("room for it");
    let mut out = vec![0.0; 2 * 480];
    let (mut beds, mut counted) = (Vec::new(), 0);
    for step in 0..400_u16 {
        let x = f32::from(step) * 0.1;
        // dropped while it renders: the last to hold a clip is the mixer
        let own = Content::Clip(if step % 3 == 0 { Arc::clone(&blip) } else { Arc::new((*blip).clone()) });
        let place = Vec3::new(x.sin() * 9.0, 1.0, x.cos() * 30.0);
        control.when((step % 4 == 0).then(|| u64::from(step) * 480 + 5000));
        if let Ok(id) = control.add(own, &SourceSettings { place, looping: step % 7 == 0, ..SourceSettings::default() }) {
            let _ = if step % 5 == 0 { control.remove(id) } else { control.seek(id, 0.05) };
        }
        control.when(None);
        control.listener(Vec3::new(x, 1.7, 0.0), Quat::from_rotation_y(x)).expect("a place");
        if step % 50 == 0 {
            control.rooms(&[room(10.0 + x)]).expect("rooms");
            let curve = DayCurve::constant(0.2);
            beds.extend(control.add_bed(Content::Clip(Arc::new((*blip).clone())), curve, 1.0, true));
        }
        if step % 50 == 30
            && let Some(bed) = beds.pop()
        {
            control.remove_bed(bed).expect("it is there");
        }
        writer.push(&[0.1; 2 * 400]);
        COUNTED.set(Some(0));
        mixer.render(&mut out);
        counted += COUNTED.take().unwrap_or(0);
    }
    assert_eq!(counted, 0, "in {:.1} s", f64::from(400_u16) * 480.0 / f64::from(RATE_HZ));
    assert!(control.statistics().sources > 20);
}
