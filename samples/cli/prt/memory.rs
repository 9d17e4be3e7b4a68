//! The memory that a bake needs, and that of the machine.

use lucerna::{Error, Result, techniques::prt::Baking};

/// Bytes that a bake needs at most, about: samples and their light, and the largest stage of a cluster.
pub fn need(room: &Baking) -> u64 {
    let samples = u64::from(room.samples);
    let clusters = samples.div_ceil(room.cluster.into());
    let vectors = clusters * u64::from(room.light);
    let cluster = 2 * u64::from(room.cluster);
    let of_cluster =
        cluster * (40 * u64::from(room.directions) + 12 * cluster + 8 * vectors + 4 * u64::from(room.rays));
    // A sample is in about 21 lists of its neighbourhood, 4 bytes each.
    let stored = samples * (68 + 20 + 84 + 2 * u64::from(room.visibility + room.light) + 4 * 300);
    let transfer = samples * if room.receivers > 0 { 2 * u64::from(room.receivers) } else { 4 * vectors };
    // A sample has as many links as parts of the least share fit into its hemisphere; in files and on the device.
    let links = if room.links > 0.0 { (1.0 / room.links).min(f64::from(room.rays / 4)) as u64 } else { 0 };
    let linked = samples * (14 * links + 4 * u64::from(room.light));
    // In a file, and on the device.
    let directions = 8 * samples * u64::from(room.directional.min(room.rays));
    // All scatterings are solved between all vectors.
    let solved = 32 * vectors * vectors;
    (160 << 20) + solved + 2 * of_cluster + 2 * stored + 2 * transfer + linked + directions
}

/// Refuses a bake that needs more than `free` bytes; `None`: unknown.
///
/// # Errors
/// `Usage` with both numbers.
pub fn expect_free(room: &Baking, free: Option<u64>) -> Result<()> {
    let need = need(room);
    let Some(free) = free.filter(|free| *free < need) else { return Ok(()) };
    let what = format!("{} samples need about {need} bytes of memory, {free} are free", room.samples);
    Err(Error::usage(what).at("room.samples").help("Choose fewer samples, rays, directions or vectors"))
}

/// Bytes that this process may still take: of the machine's free memory, or what its control group leaves. `None`: unknown.
pub fn available() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let of_group = || {
        let [most, used, parts] = ["max", "current", "stat"].map(|name| read(&format!("/sys/fs/cgroup/memory.{name}")));
        Some([most?, used?, parts?])
    };
    least(&read("/proc/meminfo")?, of_group().as_ref().map(|texts| texts.each_ref().map(String::as_str)))
}

/// The same from the text of `/proc/meminfo`, and from those of the group's limit (`max`: none), of its use and of the parts of its use.
fn least(meminfo: &str, of_group: Option<[&str; 3]>) -> Option<u64> {
    let number = |text: &str, name: &str| -> Option<u64> {
        text.lines().find_map(|line| line.strip_prefix(name)?.split_whitespace().next()?.parse().ok())
    };
    let free = 1024 * number(meminfo, "MemAvailable:")?;
    let left = of_group.and_then(|[most, used, parts]| {
        // Files that are kept in memory give way.
        let used = number(used, "")?.saturating_sub(number(parts, "file ").unwrap_or(0));
        Some(number(most, "")?.saturating_sub(used))
    });
    Some(left.map_or(free, |left| left.min(free)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_the_free_memory_is_refused_with_both_numbers() {
        let room = Baking { samples: 1_000_000, cluster: 4096, ..Baking::default() };
        let bytes = need(&room);
        // 1 GB at least: samples, the light of 300 lights, and the coefficients of receivers.
        assert!(bytes > 1_000_000 * (68 + 4 * 300 + 96) && bytes < 32 << 30, "{bytes}");
        expect_free(&room, Some(bytes)).unwrap();
        expect_free(&room, None).unwrap();
        let error = expect_free(&room, Some(bytes - 1)).unwrap_err();
        let text = error.to_string();
        for part in ["room.samples", "1000000 samples", &format!("{bytes} bytes"), &format!("{} are free", bytes - 1)] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert_eq!(error.exit_code(), 2);
    }

    #[test]
    fn the_limit_of_a_group_counts_where_it_is_lower() {
        let text = "MemTotal:       24000000 kB\nMemFree: 1 kB\nMemAvailable:   20000 kB\n";
        assert_eq!(least(text, None), Some(20_480_000));
        let parts = "anon 400\nfile 600\nfile_mapped 7\n";
        assert_eq!(least(text, Some(["max\n", "5\n", parts])), Some(20_480_000));
        assert_eq!(least(text, Some(["3000000\n", "1000600\n", parts])), Some(2_000_000));
        assert_eq!(least(text, Some(["1000\n", "1601\n", parts])), Some(0));
        assert_eq!(least("MemTotal: 5 kB\n", None), None);
    }
}
