//! What this process has taken, as Linux tells it.

/// The most memory that it ever had, in bytes; `None` on other systems.
#[must_use]
pub fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib << 10)
}

/// Seconds that all its threads have worked, to a hundredth; `None` on other systems.
#[must_use]
pub fn processor_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // the name, in brackets, may hold spaces; user and system time are the twelfth and the next after it, in hundredths
    let after = stat.rsplit_once(") ")?.1;
    let ticks = after.split(' ').skip(11).take(2).map(str::parse::<f64>);
    ticks.sum::<Result<f64, _>>().ok().map(|ticks| ticks / 100.0)
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::*;

    #[test]
    fn both_grow_with_what_is_done() {
        let (before_bytes, before_s) = (peak_bytes().unwrap_or(0), processor_seconds().unwrap_or(0.0));
        let mut block = vec![1_u8; 96 << 20];
        let begun = std::time::Instant::now();
        while begun.elapsed().as_secs_f64() < 0.2 {
            block.iter_mut().for_each(|byte| *byte = byte.wrapping_mul(5).wrapping_add(1));
            std::hint::black_box(&block);
        }
        assert!(peak_bytes().is_some_and(|bytes| bytes >= before_bytes.max(96 << 20)));
        assert!(processor_seconds().is_some_and(|s| s > before_s));
    }
}
