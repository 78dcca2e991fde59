//! The memory of this process: what it takes, and what it can give back.

/// The most that was ever resident, in bytes, where the operating system tells (Linux).
#[must_use]
pub fn peak_resident_bytes() -> Option<u64> {
    told_bytes("VmHWM:")
}

/// What is resident now, in bytes, where the operating system tells (Linux).
#[must_use]
pub fn resident_bytes() -> Option<u64> {
    told_bytes("VmRSS:")
}

fn told_bytes(name: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}

/// Gives back to the operating system what is free now. glibc keeps what was freed in small blocks, and never finds it again for large ones:
/// between the steps of a bake that is a gigabyte. Elsewhere the allocator is left as it is.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[expect(unsafe_code, reason = "glibc's allocator is told by a C function")]
pub fn give_back_freed_memory() {
    // SAFETY: malloc_trim takes the allocator's own locks and returns only pages that hold no allocation.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// Elsewhere the allocator is left as it is.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn give_back_freed_memory() {}
