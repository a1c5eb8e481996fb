//! How much memory is left.

/// Bytes that programs can still have without the system having to swap; unknown on other systems than Linux.
pub fn available() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    parse(&text)
}

fn parse(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_system_tells_in_its_own_way() {
        let text = "MemTotal:       24657328 kB\nMemFree:         3037548 kB\nMemAvailable:    2000000 kB\n";
        assert_eq!(parse(text), Some(2_048_000_000));
        assert_eq!(parse("MemTotal: 5 kB\n"), None);
        assert!(!cfg!(target_os = "linux") || available().is_some_and(|bytes| bytes > 1 << 20));
    }
}
