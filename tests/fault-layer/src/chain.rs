//! The layer's place in the loader's chain: finding the next layer, and being found.

use std::{
    collections::HashMap,
    ffi::{CStr, c_char, c_void},
    mem::transmute,
    sync::{Mutex, PoisonError},
};

use ash::vk::{self, Handle};

use crate::{lies, rules, wrap};

type GetInstance = unsafe extern "system" fn(vk::Instance, *const c_char) -> vk::PFN_vkVoidFunction;
type GetDevice = unsafe extern "system" fn(vk::Device, *const c_char) -> vk::PFN_vkVoidFunction;

#[repr(C)]
struct InstanceLink {
    next: *mut InstanceLink,
    get_instance: GetInstance,
    get_physical: *const c_void,
}

#[repr(C)]
struct DeviceLink {
    next: *mut DeviceLink,
    get_instance: GetInstance,
    get_device: GetDevice,
}

/// `VkLayerInstanceCreateInfo` and `VkLayerDeviceCreateInfo`, as far as they are alike.
#[repr(C)]
struct LayerInfo {
    kind: i32,
    next: *const c_void,
    function: i32,
    link: *mut c_void,
}

#[repr(C)]
pub struct Negotiate {
    kind: i32,
    next: *const c_void,
    version: u32,
    get_instance: Option<GetInstance>,
    get_device: Option<GetDevice>,
    get_physical: *const c_void,
}

#[derive(Clone, Copy)]
struct Next {
    handle: u64,
    get: usize,
}

/// By dispatch key: the loader's table that the first word of every dispatchable handle points to.
static INSTANCES: Mutex<Option<HashMap<usize, Next>>> = Mutex::new(None);
static DEVICES: Mutex<Option<HashMap<usize, Next>>> = Mutex::new(None);
/// Functions of physical devices must be asked for while the instance is made; later the loader's own answers recurse.
static PHYSICAL: Mutex<Option<HashMap<(usize, &'static CStr), usize>>> = Mutex::new(None);

fn with<T, R>(map: &Mutex<Option<T>>, f: impl FnOnce(&mut T) -> R) -> R
where
    T: Default,
{
    f(map.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default())
}

unsafe fn key(handle: u64) -> usize {
    unsafe { *(handle as *const usize) }
}

/// The next layer's `name` for the device that `handle` (device, queue or command buffer) belongs to.
pub unsafe fn device_next(handle: u64, name: &CStr) -> vk::PFN_vkVoidFunction {
    let next = with(&DEVICES, |devices| devices.get(&unsafe { key(handle) }).copied())?;
    unsafe { transmute::<usize, GetDevice>(next.get)(vk::Device::from_raw(next.handle), name.as_ptr()) }
}

/// The next layer's `name` for the instance that the physical device belongs to.
pub unsafe fn physical_next(handle: u64, name: &'static CStr) -> Option<usize> {
    with(&PHYSICAL, |functions| functions.get(&(unsafe { key(handle) }, name)).copied())
}

unsafe fn find(mut info: *mut LayerInfo, kind: vk::StructureType) -> *mut LayerInfo {
    unsafe {
        while !info.is_null() && ((*info).kind != kind.as_raw() || (*info).function != 0) {
            info = (*info).next.cast_mut().cast();
        }
    }
    info
}

pub unsafe extern "system" fn create_instance(
    create: *const vk::InstanceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::Instance,
) -> vk::Result {
    unsafe {
        rules::begin();
        if let Some(result) = rules::failure("vkCreateInstance", false) {
            return result;
        }
        let info = find((*create).p_next.cast_mut().cast(), vk::StructureType::LOADER_INSTANCE_CREATE_INFO);
        if info.is_null() {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        }
        let link = (*info).link.cast::<InstanceLink>();
        let get = (*link).get_instance;
        (*info).link = (*link).next.cast();
        let Some(next) = get(vk::Instance::null(), c"vkCreateInstance".as_ptr()) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let next: vk::PFN_vkCreateInstance = transmute(next);
        let result = next(create, allocator, out);
        if result == vk::Result::SUCCESS {
            let instance = *out;
            let key = key(instance.as_raw());
            with(&INSTANCES, |all| all.insert(key, Next { handle: instance.as_raw(), get: get as usize }));
            with(&PHYSICAL, |functions| {
                for name in lies::FUNCTIONS {
                    if let Some(function) = get(instance, name.as_ptr()) {
                        functions.insert((key, name), function as usize);
                    }
                }
            });
        }
        result
    }
}

pub unsafe extern "system" fn create_device(
    physical: vk::PhysicalDevice,
    create: *const vk::DeviceCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::Device,
) -> vk::Result {
    unsafe {
        if let Some(result) = rules::failure("vkCreateDevice", false) {
            return result;
        }
        let info = find((*create).p_next.cast_mut().cast(), vk::StructureType::LOADER_DEVICE_CREATE_INFO);
        let instance = with(&INSTANCES, |all| all.get(&key(physical.as_raw())).copied());
        let (false, Some(instance)) = (info.is_null(), instance) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let link = (*info).link.cast::<DeviceLink>();
        let (get_instance, get_device) = ((*link).get_instance, (*link).get_device);
        (*info).link = (*link).next.cast();
        let Some(next) = get_instance(vk::Instance::from_raw(instance.handle), c"vkCreateDevice".as_ptr()) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let next: vk::PFN_vkCreateDevice = transmute(next);
        let result = next(physical, create, allocator, out);
        if result == vk::Result::SUCCESS {
            let device = (*out).as_raw();
            with(&DEVICES, |all| all.insert(key(device), Next { handle: device, get: get_device as usize }));
            rules::revive();
        }
        result
    }
}

fn own(name: &CStr) -> Option<*const c_void> {
    match name.to_bytes() {
        b"vkGetInstanceProcAddr" => Some(get_instance_proc as *const c_void),
        b"vkGetDeviceProcAddr" => Some(get_device_proc as *const c_void),
        b"vkCreateInstance" => Some(create_instance as *const c_void),
        b"vkCreateDevice" => Some(create_device as *const c_void),
        _ => lies::own(name).or_else(|| wrap::own(name)),
    }
}

unsafe extern "system" fn get_instance_proc(instance: vk::Instance, name: *const c_char) -> vk::PFN_vkVoidFunction {
    unsafe {
        let name = CStr::from_ptr(name);
        if let Some(own) = own(name) {
            return transmute::<*const c_void, vk::PFN_vkVoidFunction>(own);
        }
        if instance.is_null() {
            return None;
        }
        let next = with(&INSTANCES, |all| all.get(&key(instance.as_raw())).copied())?;
        transmute::<usize, GetInstance>(next.get)(instance, name.as_ptr())
    }
}

unsafe extern "system" fn get_device_proc(device: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
    unsafe {
        let name = CStr::from_ptr(name);
        let next = device_next(device.as_raw(), name)?;
        // Only what the device has.
        Some(own(name).map_or(next, |own| transmute::<*const c_void, unsafe extern "system" fn()>(own)))
    }
}

/// Where the loader begins.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(negotiate: *mut Negotiate) -> vk::Result {
    unsafe {
        (*negotiate).version = 2;
        (*negotiate).get_instance = Some(get_instance_proc);
        (*negotiate).get_device = Some(get_device_proc);
        (*negotiate).get_physical = std::ptr::null();
    }
    vk::Result::SUCCESS
}
