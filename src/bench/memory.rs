//! Resident memory of this process, where the system tells it (Linux).

/// Forgets the peak so far, so that the next one is that of what runs in between.
pub fn forget_peak() {
    // Where it cannot be forgotten, the peak is that of the whole process, which a growing series
    // reaches last as well.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Bytes resident at the peak; none where the system does not say.
pub fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes << 10)
}
