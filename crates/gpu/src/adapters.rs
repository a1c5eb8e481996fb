//! Which GPU adapters there are, what each lacks, which one is taken, and what to install when
//! there is none.

use std::path::PathBuf;

use wgpu::{Adapter, AdapterInfo, Backends, DeviceType, Features};

use crate::plan::Record;
use planisphere_shaders::{Lanes, SUBGROUP, WORKGROUP};

/// Storage buffers that the largest variant binds.
const STORAGE_BUFFERS: u32 = 7;
/// Least size of a storage binding: a million spheres.
const BINDING: u64 = (size_of::<Record>() as u64) << 20;

/// Which adapter to take.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AdapterChoice {
    /// A hardware GPU.
    Hardware,
    /// Any adapter, hardware first.
    Any,
    /// The first adapter whose name contains this, in any case; hardware first.
    Named(String),
}

/// No adapter fits; says what was tried and what to install.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct NoAdapter(pub String);

/// An adapter in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// Its name, driver and API.
    pub name: String,
    /// `integrated`, `discrete`, `virtual`, `software` or `unknown`.
    pub kind: &'static str,
    /// Whether it is hardware: what `auto` takes.
    pub hardware: bool,
    /// What it lacks; empty if it can be used.
    pub lacks: Vec<String>,
    /// What it lacks but need not have, with what that means.
    pub remarks: Vec<String>,
}

/// What an adapter, or a device of it, can do for us.
#[derive(Clone, Debug)]
struct Suitability {
    /// Which kernel.
    lanes: Lanes,
    lacks: Vec<String>,
    remarks: Vec<String>,
}

fn backends() -> Backends {
    Backends::VULKAN | Backends::METAL | Backends::DX12
}

fn list() -> Vec<Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: backends(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    pollster::block_on(instance.enumerate_adapters(backends()))
}

/// Name, driver and API of an adapter.
pub fn name(info: &AdapterInfo) -> String {
    let driver = [info.driver.as_str(), info.driver_info.as_str()].join(" ");
    match driver.trim() {
        "" => format!("{} ({})", info.name, info.backend),
        driver => format!("{} ({driver}, {})", info.name, info.backend),
    }
}

/// What a hardware GPU has in the file system of Linux, before any driver is asked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Node {
    /// Its path.
    path: String,
    /// Why this process cannot open it, if so.
    closed: Option<String>,
}

/// The paths of all nodes. Kernel graphics (all open drivers), NVIDIA, WSL, Arm and Qualcomm have
/// them.
fn node_paths() -> Vec<PathBuf> {
    let named = ["/dev/nvidiactl", "/dev/dxg", "/dev/mali0", "/dev/kgsl-3d0"].map(PathBuf::from);
    let mut paths: Vec<_> = named.into_iter().filter(|path| path.exists()).collect();
    let entries = std::fs::read_dir("/dev/dri").into_iter().flatten().flatten();
    paths.extend(entries.map(|entry| entry.path()).filter(|path| {
        path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("renderD"))
    }));
    paths.sort();
    paths
}

/// The nodes of this machine, each tried.
pub fn nodes() -> Vec<Node> {
    let node = |path: PathBuf| {
        let closed = std::fs::File::options().read(true).write(true).open(&path).err();
        Node {
            path: planisphere_core::text::name(path),
            closed: closed.map(|error| error.to_string()),
        }
    };
    if cfg!(target_os = "linux") {
        node_paths().into_iter().map(node).collect()
    } else {
        Vec::new()
    }
}

/// Whether a hardware GPU is possible: on Linux each driver has a device node, and looking for one
/// is a thousand times faster than loading Vulkan.
pub fn may_have_hardware() -> bool {
    cfg!(not(target_os = "linux")) || !node_paths().is_empty()
}

/// What the environment says about Vulkan's drivers: only those that it names are looked at.
pub fn named_drivers() -> Option<String> {
    let set = |name: &str| {
        Some((name.to_owned(), std::env::var(name).ok().filter(|value| !value.is_empty())?))
    };
    let (name, value) = set("VK_DRIVER_FILES").or_else(|| set("VK_ICD_FILENAMES"))?;
    let missing = std::env::split_paths(&value).filter(|path| !path.exists());
    let missing: Vec<_> = missing
        .map(|path| format!("; {} is not there", planisphere_core::text::name(path)))
        .collect();
    Some(format!("{name}={value} is set, so that no other driver is looked at{}", missing.concat()))
}

fn is_hardware(info: &AdapterInfo) -> bool {
    matches!(
        info.device_type,
        DeviceType::DiscreteGpu | DeviceType::IntegratedGpu | DeviceType::VirtualGpu
    )
}

fn assess(adapter: &Adapter) -> Suitability {
    let mut suitability = suitability(&adapter.get_info(), &adapter.limits(), adapter.features());
    if !adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS) {
        suitability.lacks.insert(0, "compute shaders".into());
    }
    suitability
}

/// What can be done within some limits and with some features.
fn suitability(info: &AdapterInfo, limits: &wgpu::Limits, features: Features) -> Suitability {
    let mut lacks = Vec::new();
    let buffers = limits.max_storage_buffers_per_shader_stage;
    if buffers < STORAGE_BUFFERS {
        lacks.push(format!("{STORAGE_BUFFERS} storage buffers in a shader (it has {buffers})"));
    }
    let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if binding < BINDING {
        lacks.push(format!("storage bindings of {} MiB (it has {})", BINDING >> 20, binding >> 20));
    }
    let workgroup =
        limits.max_compute_invocations_per_workgroup.min(limits.max_compute_workgroup_size_x);
    if workgroup < WORKGROUP {
        lacks.push(format!("workgroups of {WORKGROUP}"));
    }
    let mut remarks = Vec::new();
    let eight = (info.subgroup_min_size, info.subgroup_max_size) == (SUBGROUP, SUBGROUP);
    let lanes = if eight && features.contains(Features::SUBGROUP) {
        Lanes::Eight
    } else {
        remarks.push(format!("no subgroups of exactly {SUBGROUP}: the portable kernel is used"));
        Lanes::Alone
    };
    Suitability { lanes, lacks, remarks }
}

/// What to ask an adapter for, so that its device can be used.
///
/// # Errors
/// When the adapter lacks something; says what.
pub fn descriptor(adapter: &Adapter) -> Result<wgpu::DeviceDescriptor<'static>, String> {
    let (info, offered, Suitability { lanes, lacks, .. }) =
        (adapter.get_info(), adapter.limits(), assess(adapter));
    if !lacks.is_empty() {
        return Err(format!("{} lacks {}", name(&info), lacks.join(", ")));
    }
    let binding =
        offered.max_storage_buffer_binding_size.min(i32::MAX as u64).min(offered.max_buffer_size);
    let limits = wgpu::Limits {
        max_storage_buffer_binding_size: binding,
        max_buffer_size: offered.max_buffer_size,
        max_storage_buffers_per_shader_stage: offered.max_storage_buffers_per_shader_stage.min(8),
        max_compute_workgroups_per_dimension: offered.max_compute_workgroups_per_dimension,
        ..wgpu::Limits::downlevel_defaults()
    };
    let mut features = match lanes {
        Lanes::Eight => Features::SUBGROUP,
        Lanes::Alone => Features::empty(),
    };
    if info.device_type == DeviceType::Cpu {
        features |= adapter.features() & Features::MAPPABLE_PRIMARY_BUFFERS;
    }
    Ok(wgpu::DeviceDescriptor {
        label: Some("planisphere"),
        required_features: features,
        required_limits: limits,
        ..Default::default()
    })
}

/// Which kernel a device can run.
///
/// # Errors
/// When the device was created with too little; says with what.
pub(super) fn lanes_of(device: &wgpu::Device) -> Result<Lanes, String> {
    let info = device.adapter_info();
    let Suitability { lanes, lacks, .. } = suitability(&info, &device.limits(), device.features());
    if lacks.is_empty() {
        Ok(lanes)
    } else {
        Err(format!("the device of {} was created without {}", name(&info), lacks.join(", ")))
    }
}

/// Every adapter of this machine.
pub fn adapters() -> Vec<Found> {
    list()
        .iter()
        .map(|adapter| {
            let (info, Suitability { lacks, remarks, .. }) = (adapter.get_info(), assess(adapter));
            let kind = match info.device_type {
                DeviceType::IntegratedGpu => "integrated",
                DeviceType::DiscreteGpu => "discrete",
                DeviceType::VirtualGpu => "virtual",
                DeviceType::Cpu => "software",
                DeviceType::Other => "unknown",
            };
            Found { name: name(&info), kind, hardware: is_hardware(&info), lacks, remarks }
        })
        .collect()
}

/// Why an adapter is not taken whose name was not asked for.
const ANOTHER_NAME: &str = "another name";

/// An adapter that was not taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PassedOver {
    /// Its name, driver and API.
    pub adapter: String,
    /// Whether it is hardware.
    pub hardware: bool,
    /// Why it was not taken.
    pub why: String,
}

/// An adapter that may be taken: all that the choice depends on.
#[derive(Clone, Debug)]
struct Candidate {
    name: String,
    hardware: bool,
    lacks: Vec<String>,
}

/// Opens the first adapter that fits a choice, hardware before software; tells which ones did not
/// come to that, and why.
fn take<T>(
    choice: &AdapterChoice,
    candidates: &[Candidate],
    mut open: impl FnMut(usize) -> Result<T, String>,
) -> (Option<T>, Vec<PassedOver>) {
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    order.sort_by_key(|&k| !candidates[k].hardware);
    let mut passed_over = Vec::new();
    for k in order {
        let Candidate { name, hardware, lacks } = &candidates[k];
        let why = match choice {
            AdapterChoice::Hardware if !hardware => "a software device".to_owned(),
            AdapterChoice::Named(part) if !name.to_lowercase().contains(&part.to_lowercase()) => {
                ANOTHER_NAME.into()
            }
            _ if !lacks.is_empty() => format!("lacks {}", lacks.join(", ")),
            _ => match open(k) {
                Ok(device) => return (Some(device), passed_over),
                Err(why) => format!("could not be opened: {why}"),
            },
        };
        passed_over.push(PassedOver { adapter: name.clone(), hardware: *hardware, why });
    }
    (None, passed_over)
}

/// Opens an adapter for a choice.
pub(super) fn open<T>(
    choice: &AdapterChoice,
    mut open: impl FnMut(&Adapter) -> Result<T, String>,
) -> (Option<T>, Vec<PassedOver>) {
    let adapters: Vec<_> = list().into_iter().map(|adapter| (assess(&adapter), adapter)).collect();
    let candidate = |(suitability, adapter): &(Suitability, Adapter)| {
        let info = adapter.get_info();
        Candidate {
            name: name(&info),
            hardware: is_hardware(&info),
            lacks: suitability.lacks.clone(),
        }
    };
    let candidates: Vec<_> = adapters.iter().map(candidate).collect();
    take(choice, &candidates, |k| open(&adapters[k].1))
}

/// The hardware that did not open although it was meant, with the reasons.
pub fn why_asked(passed_over: &[PassedOver]) -> Option<String> {
    let meant = passed_over.iter().filter(|other| other.hardware && other.why != ANOTHER_NAME);
    let words: Vec<_> =
        meant.map(|other| format!("the hardware GPU {} {}", other.adapter, other.why)).collect();
    (!words.is_empty()).then(|| words.join("; "))
}

/// Why `auto` has taken what it has taken: a hardware GPU, or else the CPU.
pub fn why_auto(
    hardware: bool,
    passed_over: &[PassedOver],
    nodes: &[Node],
    drivers: Option<&str>,
) -> String {
    if let Some(words) = why_asked(passed_over) {
        return words;
    }
    if hardware {
        return "a hardware GPU was found".into();
    }
    let drivers = drivers.map(|words| format!("; {words}")).unwrap_or_default();
    match nodes {
        [] => format!("no hardware GPU was found{drivers}"),
        nodes => {
            let nodes: Vec<String> = nodes
                .iter()
                .map(|Node { path, closed }| match closed {
                    Some(why) => format!("{path} (which cannot be opened: {why})"),
                    None => path.clone(),
                })
                .collect();
            format!(
                "no {} driver answers for the hardware GPU at {}{drivers}",
                api(),
                nodes.join(", ")
            )
        }
    }
}

/// That nothing was opened: what was tried, and what to install.
pub fn none(
    choice: &AdapterChoice,
    passed_over: &[PassedOver],
    drivers: Option<&str>,
) -> NoAdapter {
    let wanted = match choice {
        AdapterChoice::Hardware => "no hardware GPU".to_owned(),
        AdapterChoice::Named(name) => {
            format!("no GPU whose name contains \"{}\"", planisphere_core::text::value(name))
        }
        _ => "no usable GPU".to_owned(),
    };
    let mut tried = format!("tried {}:", api());
    if passed_over.is_empty() {
        tried += " no adapter answered";
    }
    for PassedOver { adapter, why, .. } in passed_over {
        tried += &format!("\n  {adapter}: {why}");
    }
    if let Some(words) = drivers {
        tried += &format!("\n{words}");
    }
    let install = match std::env::consts::OS {
        "linux" => {
            "a software device comes with mesa-vulkan-drivers (Debian, Ubuntu, Fedora) or \
             vulkan-swrast (Arch); hardware needs its vendor's Vulkan driver; the CPU needs neither"
        }
        _ => "install the graphics driver of the machine's vendor; the CPU needs none",
    };
    NoAdapter(format!("{wanted}; {tried}\n{install}"))
}

/// The APIs that are looked at on this system.
fn api() -> &'static str {
    match std::env::consts::OS {
        "macos" => "Metal",
        "windows" => "Vulkan and Direct3D 12",
        _ => "Vulkan",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(name: &str, hardware: bool, lacks: &[&str]) -> Candidate {
        Candidate {
            name: name.into(),
            hardware,
            lacks: lacks.iter().map(|&what| what.into()).collect(),
        }
    }

    #[test]
    fn as_many_buffers_are_asked_for_as_are_bound() {
        // All but the first are storage.
        let bound = planisphere_shaders::Variant::all().map(|variant| variant.bindings().len() - 1);
        assert_eq!(bound.max(), Some(STORAGE_BUFFERS as usize));
    }

    /// A discrete GPU, one that is built in, and two software devices, in the order in which a
    /// loader might list them.
    fn machine() -> Vec<Candidate> {
        vec![
            candidate("llvmpipe (Mesa, vulkan)", false, &[]),
            candidate("Radeon 7900 (radv, vulkan)", true, &[]),
            candidate("SwiftShader (vulkan)", false, &[]),
            candidate("Arc 770 (anv, vulkan)", true, &[]),
        ]
    }

    /// Takes from a list, where those with these names do not open; the name that was taken, and
    /// what was passed over.
    fn taken(
        choice: &AdapterChoice,
        candidates: &[Candidate],
        closed: &[&str],
    ) -> (Option<String>, Vec<PassedOver>) {
        take(choice, candidates, |k| {
            let name = candidates[k].name.clone();
            let fails = closed.iter().any(|part| name.contains(part));
            if fails { Err("device lost".into()) } else { Ok(name) }
        })
    }

    fn named(name: &str) -> AdapterChoice {
        AdapterChoice::Named(name.into())
    }

    #[test]
    fn hardware_comes_first_and_the_next_is_tried() {
        use AdapterChoice::{Any, Hardware};
        let machine = machine();
        for (choice, closed, want, passed) in [
            (Hardware, &[][..], Some("Radeon"), 0),
            (Any, &[], Some("Radeon"), 0),
            (Hardware, &["Radeon"], Some("Arc"), 1),
            (Any, &["Radeon"], Some("Arc"), 1),
            (Hardware, &["Radeon", "Arc"], None, 4),
            (Any, &["Radeon", "Arc"], Some("llvmpipe"), 2),
            (Any, &["Radeon", "Arc", "llvmpipe"], Some("SwiftShader"), 3),
            (Any, &["vulkan"], None, 4),
            (named("SWIFT"), &[], Some("SwiftShader"), 3),
            (named("swift"), &["Swift"], None, 4),
            (named("arc"), &[], Some("Arc"), 1),
            (named("nobody"), &[], None, 4),
        ] {
            let (name, passed_over) = taken(&choice, &machine, closed);
            assert_eq!(
                name.as_deref().map(|name| name.split(' ').next().unwrap()),
                want,
                "{choice:?}, {closed:?}"
            );
            assert_eq!(passed_over.len(), passed, "{choice:?}, {closed:?}: {passed_over:?}");
        }
        let nothing: (Option<()>, _) = take(&Hardware, &[], |_| unreachable!("there is none"));
        assert_eq!(nothing, (None, Vec::new()));
    }

    #[test]
    fn what_lacks_something_is_never_opened() {
        let mut machine = machine();
        machine[1].lacks = vec!["compute shaders".into(), "workgroups of 64".into()];
        let (name, passed_over) = taken(&AdapterChoice::Hardware, &machine, &["Radeon"]);
        assert_eq!(name.as_deref(), Some("Arc 770 (anv, vulkan)"));
        assert_eq!(passed_over[0].why, "lacks compute shaders, workgroups of 64");
    }

    #[test]
    fn auto_names_the_hardware_that_was_not_taken() {
        let why = |machine: &[Candidate], closed: &[&str], nodes: &[Node], drivers| {
            let (name, passed_over) = taken(&AdapterChoice::Hardware, machine, closed);
            why_auto(name.is_some(), &passed_over, nodes, drivers)
        };
        let all = machine();
        let software = [all[0].clone(), all[2].clone()];
        let lacking =
            [all[0].clone(), candidate("Old 9000 (r600, vulkan)", true, &["compute shaders"])];
        assert_eq!(why(&all, &[], &[], None), "a hardware GPU was found");
        assert_eq!(
            why(&all, &["Radeon"], &[], None),
            "the hardware GPU Radeon 7900 (radv, vulkan) could not be opened: device lost"
        );
        let both = why(&all, &["Radeon", "Arc"], &[], None);
        assert!(
            both.contains("Radeon 7900") && both.contains("; the hardware GPU Arc 770"),
            "{both}"
        );
        assert!(!both.contains("no hardware GPU was found"), "{both}");
        assert_eq!(
            why(&lacking, &[], &[], None),
            "the hardware GPU Old 9000 (r600, vulkan) lacks compute shaders"
        );
        assert_eq!(why(&software, &[], &[], None), "no hardware GPU was found");
        assert_eq!(why(&[], &[], &[], None), "no hardware GPU was found");
        // There is hardware, and nothing answers for it.
        let open = Node { path: "/dev/dri/renderD128".into(), closed: None };
        let closed =
            Node { path: "/dev/dri/renderD129".into(), closed: Some("Permission denied".into()) };
        let words = why(&software, &[], &[open.clone(), closed], None);
        assert!(
            words.contains(
                "answers for the hardware GPU at /dev/dri/renderD128, /dev/dri/renderD129"
            ),
            "{words}"
        );
        assert!(words.ends_with("(which cannot be opened: Permission denied)"), "{words}");
        let words = why(&[], &[], &[open], Some("VK_DRIVER_FILES=x.json is set"));
        assert!(words.ends_with("renderD128; VK_DRIVER_FILES=x.json is set"), "{words}");
        // What did answer is named, not its node.
        assert!(!why(&all, &["Radeon", "Arc"], &[], Some("set")).contains("set"));
    }

    #[test]
    fn nothing_opened_says_what_was_tried_and_what_to_install() {
        let (_, passed_over) = taken(&named("GeForce"), &machine(), &[]);
        let error = none(&named("GeForce"), &passed_over, None).to_string();
        assert!(error.starts_with("no GPU whose name contains \"GeForce\"; tried "), "{error}");
        assert!(error.contains("\n  Arc 770 (anv, vulkan): another name\n"), "{error}");
        assert!(!cfg!(target_os = "linux") || error.contains("mesa-vulkan-drivers"), "{error}");
        let (_, passed_over) = taken(&AdapterChoice::Any, &machine(), &["vulkan"]);
        let error = none(&AdapterChoice::Any, &passed_over, None).to_string();
        assert_eq!(error.matches("could not be opened: device lost").count(), 4, "{error}");
        let error = none(&AdapterChoice::Any, &[], Some("VK_DRIVER_FILES=x is set")).to_string();
        assert!(error.contains("no adapter answered\nVK_DRIVER_FILES=x is set\n"), "{error}");
    }
}
