//! Which GPU adapters there are, what each lacks, which one is taken, and what to install when there is none.

use std::path::Path;

use wgpu::{Adapter, AdapterInfo, Backends, DeviceType, Features};

use crate::{
    render::{DeviceChoice, DeviceError},
    shader::Lanes,
};

/// Storage buffers that the largest variant binds.
const STORAGE_BUFFERS: u32 = 7;
/// Least size of a storage binding: a million spheres.
const BINDING: u64 = 16 << 20;

/// An adapter in words.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
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

/// What an adapter can do for us.
#[derive(Clone, Debug)]
pub(super) struct Suitability {
    /// Which kernel.
    pub lanes: Lanes,
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

/// Whether a hardware GPU is possible: on Linux each driver has a device node, and looking for one is a thousand times faster
/// than loading Vulkan.
pub fn may_have_hardware() -> bool {
    if cfg!(not(target_os = "linux")) {
        return true;
    }
    // Kernel graphics (all open drivers), NVIDIA, WSL, Arm and Qualcomm.
    let nodes = ["/dev/nvidiactl", "/dev/dxg", "/dev/mali0", "/dev/kgsl-3d0"];
    nodes.iter().any(|node| Path::new(node).exists())
        || std::fs::read_dir("/dev/dri").is_ok_and(|mut entries| {
            entries.any(|entry| entry.is_ok_and(|entry| entry.file_name().to_string_lossy().starts_with("renderD")))
        })
}

fn is_hardware(info: &AdapterInfo) -> bool {
    matches!(info.device_type, DeviceType::DiscreteGpu | DeviceType::IntegratedGpu | DeviceType::VirtualGpu)
}

fn assess(adapter: &Adapter) -> Suitability {
    let (info, limits) = (adapter.get_info(), adapter.limits());
    let mut lacks = Vec::new();
    if !adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS) {
        lacks.push("compute shaders".into());
    }
    let buffers = limits.max_storage_buffers_per_shader_stage;
    if buffers < STORAGE_BUFFERS {
        lacks.push(format!("{STORAGE_BUFFERS} storage buffers in a shader (it has {buffers})"));
    }
    let binding = limits.max_storage_buffer_binding_size;
    if binding < BINDING {
        lacks.push(format!("storage bindings of {} MiB (it has {})", BINDING >> 20, binding >> 20));
    }
    if limits.max_compute_invocations_per_workgroup < 64 || limits.max_compute_workgroup_size_x < 64 {
        lacks.push("workgroups of 64".into());
    }
    let mut remarks = Vec::new();
    let eight = (info.subgroup_min_size, info.subgroup_max_size) == (8, 8);
    let lanes = if eight && adapter.features().contains(Features::SUBGROUP) {
        Lanes::Eight
    } else {
        remarks.push("no subgroups of exactly 8: the portable kernel is used".into());
        Lanes::Alone
    };
    Suitability { lanes, lacks, remarks }
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

/// The adapter for a choice: hardware first among those that fit.
pub(super) fn choose(choice: &DeviceChoice) -> Result<(Adapter, Suitability), DeviceError> {
    let mut tried = Vec::new();
    let mut best: Option<(bool, Adapter, Suitability)> = None;
    for adapter in list() {
        let (info, suitability) = (adapter.get_info(), assess(&adapter));
        let hardware = is_hardware(&info);
        let asked = match choice {
            DeviceChoice::Auto => hardware,
            DeviceChoice::Gpu => true,
            DeviceChoice::Cpu => false,
            DeviceChoice::Named(part) => name(&info).to_lowercase().contains(&part.to_lowercase()),
        };
        if !asked {
            let why = if *choice == DeviceChoice::Auto { "a software device" } else { "another name" };
            tried.push(format!("{}: {why}", name(&info)));
        } else if !suitability.lacks.is_empty() {
            tried.push(format!("{}: lacks {}", name(&info), suitability.lacks.join(", ")));
        } else if best.as_ref().is_none_or(|(before, ..)| hardware && !before) {
            best = Some((hardware, adapter, suitability));
        }
    }
    best.map(|(_, adapter, suitability)| (adapter, suitability)).ok_or_else(|| none(choice, &tried))
}

/// What was tried, and what to install.
fn none(choice: &DeviceChoice, tried: &[String]) -> DeviceError {
    let wanted = match choice {
        DeviceChoice::Auto => "no hardware GPU".to_owned(),
        DeviceChoice::Named(name) => format!("no GPU whose name contains \"{}\"", crate::text::value(name)),
        _ => "no usable GPU".to_owned(),
    };
    let tried = match tried {
        [] => format!("tried {}: no adapter answered", api()),
        tried => format!("tried {}:\n  {}", api(), tried.join("\n  ")),
    };
    let install = match std::env::consts::OS {
        "linux" => {
            "a software device comes with mesa-vulkan-drivers (Debian, Ubuntu, Fedora) or vulkan-swrast (Arch); \
             hardware needs its vendor's Vulkan driver; `--device cpu` needs neither"
        }
        _ => "install the graphics driver of the machine's vendor; `--device cpu` needs none",
    };
    DeviceError::NoAdapter(format!("{wanted}; {tried}\n{install}"))
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

    #[test]
    fn a_name_that_nobody_has_says_what_was_tried_and_what_to_install() {
        let error = choose(&DeviceChoice::Named("no such adapter".into())).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("no such adapter") && error.contains("tried"), "{error}");
        assert!(!cfg!(target_os = "linux") || error.contains("mesa-vulkan-drivers"), "{error}");
    }
}
