//! The allocator under a driver that draws on the processor.
//!
//! Such a driver (llvmpipe) allocates and frees a scene of up to 36 MiB of triangles several times a frame. When the top of the
//! heap happens to be free, glibc gives it back to the system each time, and every frame then takes some ten thousand page
//! faults, in one run and not in another. docs/decisions/008-drawing-stone.md has the figures.

/// Free memory at the end of a heap that is kept for the next frame: a scene, and room.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const KEPT_BYTES: i32 = 64 << 20;

/// As much as glibc keeps by itself.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const USUAL_BYTES: i32 = 128 << 10;

/// Blocks from this size on go back to the system as soon as they are freed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE_BYTES: i32 = 256 << 10;

/// For programs that run for weeks, before they have threads: one heap for all of these, for only of the first one the free end can be given back, and what is large is the system's
/// again once it is freed, so that what frames need for a moment does not add up. docs/decisions/029-rooms.md has the figures.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[expect(unsafe_code, reason = "as below")]
pub fn spare_memory() {
    // SAFETY: mallopt takes the allocator's own lock and sets one word each; it touches no memory of the program.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, 1);
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE_BYTES);
    }
}

/// Lets the allocator keep what is freed, or give it back to the system as usual, from the next time something is freed.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[expect(unsafe_code, reason = "glibc's allocator is told by a C function")]
pub fn keep_freed_memory(keep: bool) {
    // SAFETY: mallopt takes the allocator's own lock and sets one word; it touches no memory of the program, and an allocation
    // beside it sees the old word or the new one, both of which are right.
    unsafe {
        libc::mallopt(libc::M_TRIM_THRESHOLD, if keep { KEPT_BYTES } else { USUAL_BYTES });
    }
}

/// Elsewhere the allocator is left as it is.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn spare_memory() {}

/// Elsewhere the allocator is left as it is.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn keep_freed_memory(_keep: bool) {}
