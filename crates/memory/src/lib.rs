//! How much memory is left: in the machine, in the control groups that the process runs in, and
//! under its own limits.

#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

/// Bytes that this process can still have without the system having to swap, or to end it; unknown
/// on other systems than Linux. The least of what each of these leaves:
///
/// * the machine (`MemAvailable` of `/proc/meminfo`);
/// * each control group around the process, of either version, as containers and batch systems set
///   them: its limit less what it uses, not counting files that the system keeps in memory and can
///   drop;
/// * the limits of the process, `RLIMIT_AS` (`ulimit -v`) and `RLIMIT_DATA` (`ulimit -d`).
pub fn available() -> Option<u64> {
    #[cfg(target_os = "linux")]
    return linux::available();
    #[cfg(not(target_os = "linux"))]
    None
}

/// Whether so many bytes can be asked for.
///
/// # Errors
/// How many are available, when these are fewer.
pub fn room(bytes: u64) -> Result<(), u64> {
    // What is small is not worth asking the system.
    if bytes < 1 << 20 {
        return Ok(());
    }
    match available() {
        Some(available) if bytes > available => Err(available),
        _ => Ok(()),
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use std::{
        fs, io,
        path::{Path, PathBuf},
    };

    pub fn available() -> Option<u64> {
        let read = |path: &str| fs::read_to_string(path).unwrap_or_default();
        let machine = machine(&read("/proc/meminfo"));
        let folders = folders(&read("/proc/self/mountinfo"), &read("/proc/self/cgroup"));
        let groups = folders.iter().flat_map(|(version, folders)| {
            let left =
                |folder: &PathBuf| group(*version, |file| fs::read_to_string(folder.join(file)));
            folders.iter().filter_map(left).collect::<Vec<_>>()
        });
        let process = process(&read("/proc/self/status"), limits(&read("/proc/self/limits")));
        machine.into_iter().chain(groups).chain(process).min()
    }

    /// The soft limits of all addresses (`RLIMIT_AS`), and of those that are written to
    /// (`RLIMIT_DATA`), of `/proc/self/limits`; nothing for one that is not set.
    pub fn limits(limits: &str) -> [Option<u64>; 2] {
        ["Max address space", "Max data size"].map(|name| {
            let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
            // Soft limit, hard limit, unit; a number or `unlimited`.
            line.split_whitespace().next()?.parse().ok()
        })
    }

    /// The number in kB on a line that begins with a word.
    fn kilobytes(text: &str, word: &str) -> Option<u64> {
        let line = text.lines().find_map(|line| line.strip_prefix(word))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
    }

    /// Of `/proc/meminfo`.
    pub fn machine(meminfo: &str) -> Option<u64> {
        kilobytes(meminfo, "MemAvailable:")
    }

    /// Of `/proc/self/status` and [`limits`].
    pub fn process(status: &str, [all, data]: [Option<u64>; 2]) -> Option<u64> {
        let left =
            |limit: Option<u64>, used: &str| Some(limit?.saturating_sub(kilobytes(status, used)?));
        left(all, "VmSize:").into_iter().chain(left(data, "VmData:")).min()
    }

    /// Versions of control groups.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Version {
        One,
        Two,
    }

    /// The folders of the groups around the process, outermost first, from `/proc/self/mountinfo`
    /// and `/proc/self/cgroup`.
    pub fn folders(mounts: &str, groups: &str) -> Vec<(Version, Vec<PathBuf>)> {
        let mut found = Vec::new();
        for line in mounts.lines() {
            // 36 35 98:0 /root /mount/point options - type source options
            let Some((left, right)) = line.split_once(" - ") else { continue };
            let mut fields = left.split(' ').skip(3).map(unescaped);
            let (Some(root), Some(mount)) = (fields.next(), fields.next()) else { continue };
            let mut words = right.split(' ');
            let version = match (words.next(), words.nth(1)) {
                (Some("cgroup2"), _) => Version::Two,
                (Some("cgroup"), Some(options))
                    if options.split(',').any(|word| word == "memory") =>
                {
                    Version::One
                }
                _ => continue,
            };
            // 0::/path for version 2, 4:memory:/path or 4:cpu,memory:/path for version 1.
            let own = groups.lines().find_map(|line| {
                let mut parts = line.splitn(3, ':').skip(1);
                let (controllers, path) = (parts.next()?, parts.next()?);
                let this = match version {
                    Version::One => controllers.split(',').any(|word| word == "memory"),
                    Version::Two => controllers.is_empty(),
                };
                this.then_some(path)
            });
            let Some(own) = own else { continue };
            // What is mounted may be a group itself, and the path may be one outside of what a
            // container sees; then the mount is the outermost group that is seen, and limits it all
            // the same.
            let inside = Path::new(own).strip_prefix(&root).unwrap_or(Path::new(""));
            let mut folder = PathBuf::from(mount);
            let mut folders = vec![folder.clone()];
            for part in
                inside.components().filter(|part| matches!(part, std::path::Component::Normal(_)))
            {
                folder.push(part);
                folders.push(folder.clone());
            }
            found.push((version, folders));
        }
        found
    }

    /// Spaces and the like, which are octal in `mountinfo`.
    fn unescaped(field: &str) -> String {
        let mut parts = field.split('\\');
        let mut text = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            match part.get(..3).and_then(|digits| u8::from_str_radix(digits, 8).ok()) {
                Some(byte) => text.extend([char::from(byte)].into_iter().chain(part[3..].chars())),
                None => text.extend(['\\'].into_iter().chain(part.chars())),
            }
        }
        text
    }

    /// What a group leaves, by its files; nothing where it sets no limit.
    pub fn group(version: Version, read: impl Fn(&str) -> io::Result<String>) -> Option<u64> {
        let number = |file: &str| read(file).ok()?.trim().parse::<u64>().ok();
        let (limits, used, prefix): (&[&str], &str, &str) = match version {
            Version::One => (&["memory.limit_in_bytes"], "memory.usage_in_bytes", "total_"),
            // Beyond the second the system holds the process up until it has become smaller.
            Version::Two => (&["memory.max", "memory.high"], "memory.current", ""),
        };
        let limit = limits.iter().filter_map(|file| number(file)).min()?;
        let statistics = read("memory.stat").unwrap_or_default();
        let files = ["inactive_file", "active_file"].iter().filter_map(|name| {
            let entry = format!("{prefix}{name} ");
            statistics
                .lines()
                .find_map(|line| line.strip_prefix(&entry))?
                .trim()
                .parse::<u64>()
                .ok()
        });
        Some(limit.saturating_sub(number(used)?.saturating_sub(files.sum())))
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn the_system_tells_in_its_own_way() {
            let text = "MemTotal:       24657328 kB\nMemFree:         3037548 kB\nMemAvailable:    \
                        2000000 kB\n";
            assert_eq!(machine(text), Some(2_048_000_000));
            assert_eq!(machine("MemTotal: 5 kB\n"), None);
            assert!(available().is_some_and(|bytes| bytes > 1 << 20));
        }

        #[test]
        fn limits_of_the_process() {
            let status = "Name:\tx\nVmSize:\t    3000 kB\nVmData:\t    1000 kB\n";
            let kb = |n: u64| Some(n * 1024);
            assert_eq!(process(status, [None, None]), None);
            assert_eq!(process(status, [kb(10_000), None]), kb(7000));
            assert_eq!(process(status, [kb(10_000), kb(1500)]), kb(500));
            assert_eq!(process(status, [kb(2000), None]), Some(0));
            assert_eq!(process("", [kb(2000), None]), None);
            let text = "Limit           Soft Limit   Hard Limit   Units\n\
                        Max data size   unlimited    9000         bytes\n\
                        Max processes   77           77           processes\n\
                        Max address space 4096000    unlimited    bytes\n";
            assert_eq!(limits(text), [kb(4000), None]);
            assert_eq!(limits(""), [None, None]);
        }

        #[test]
        fn folders_of_both_versions() {
            let paths = |folders: &[&str]| folders.iter().map(PathBuf::from).collect::<Vec<_>>();
            // A session of a desktop, version 2.
            let mounts = "25 1 0:22 / /sys rw - sysfs sysfs rw\n26 25 0:23 / /sys/fs/cgroup \
                          rw,nosuid shared:9 - cgroup2 cgroup2 rw,nsdelegate\n";
            let session = folders(mounts, "0::/user.slice/user-1000.slice/app.scope\n");
            let wanted = [
                "/sys/fs/cgroup",
                "/sys/fs/cgroup/user.slice",
                "/sys/fs/cgroup/user.slice/user-1000.slice",
                "/sys/fs/cgroup/user.slice/user-1000.slice/app.scope",
            ];
            assert_eq!(session, [(Version::Two, paths(&wanted))]);
            // A container that sees its own group as the root.
            assert_eq!(folders(mounts, "0::/\n"), [(Version::Two, paths(&["/sys/fs/cgroup"]))]);
            assert_eq!(
                folders(mounts, "0::/../..\n"),
                [(Version::Two, paths(&["/sys/fs/cgroup"]))]
            );
            // One of version 1, whose mount is its group; the folder has a space.
            let mounts = "30 25 0:26 /docker/abc /sys/fs/cgroup/me\\040mory ro - cgroup cgroup \
                          rw,memory\n31 25 0:27 /docker/abc /sys/fs/cgroup/cpu ro - cgroup cgroup \
                          rw,cpu,cpuacct\n";
            let groups =
                "5:cpu,cpuacct:/docker/abc\n4:memory:/docker/abc/job\n1:name=systemd:/docker/abc\n";
            let wanted = ["/sys/fs/cgroup/me mory", "/sys/fs/cgroup/me mory/job"];
            assert_eq!(folders(mounts, groups), [(Version::One, paths(&wanted))]);
            // Neither.
            assert_eq!(folders("", ""), []);
            assert_eq!(folders(mounts, "1:name=systemd:/\n"), []);
        }

        #[test]
        fn groups_of_both_versions() {
            let files = |entries: &'static [(&'static str, &'static str)]| {
                move |name: &str| {
                    let found = entries.iter().find(|(file, _)| *file == name);
                    found.map(|(_, text)| (*text).to_owned()).ok_or(io::ErrorKind::NotFound.into())
                }
            };
            let two = files(&[
                ("memory.max", "1000000\n"),
                ("memory.high", "max\n"),
                ("memory.current", "600000\n"),
                (
                    "memory.stat",
                    "anon 300000\nfile 400000\ninactive_file 100000\nactive_file 200000\n",
                ),
            ]);
            assert_eq!(group(Version::Two, two), Some(700_000));
            let high = files(&[
                ("memory.max", "1000\n"),
                ("memory.high", "900\n"),
                ("memory.current", "600\n"),
            ]);
            assert_eq!(group(Version::Two, high), Some(300));
            let none = files(&[("memory.max", "max\n"), ("memory.current", "600000\n")]);
            assert_eq!(group(Version::Two, none), None);
            let one = files(&[
                ("memory.limit_in_bytes", "500\n"),
                ("memory.usage_in_bytes", "700\n"),
                ("memory.stat", "inactive_file 9\ntotal_inactive_file 100\ntotal_active_file 50\n"),
            ]);
            assert_eq!(group(Version::One, one), Some(0));
            let free = files(&[
                ("memory.limit_in_bytes", "9223372036854771712\n"),
                ("memory.usage_in_bytes", "7\n"),
            ]);
            assert!(group(Version::One, free).is_some_and(|bytes| bytes > 1 << 60));
            assert_eq!(group(Version::One, files(&[])), None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_small_is_not_asked_for() {
        assert_eq!(room(1000), Ok(()));
        assert!(
            !cfg!(target_os = "linux")
                || room(u64::MAX).is_err_and(|available| available > 1 << 20)
        );
    }
}
