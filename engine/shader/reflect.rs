//! Reads the interface of a shader from its SPIR-V: a small walk over the few instructions that carry it.
//!
//! Works on unoptimised modules with debug names. Learned from the approach of zeux/niagara; the code is ours.

use std::collections::BTreeMap;

/// A type as it stands in an interface block (scalar layout).
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Type {
    F32,
    I32,
    U32,
    /// Component and count.
    Vector(Box<Type>, u32),
    /// Rows and columns of f32, column-major without padding.
    Matrix {
        rows: u32,
        columns: u32,
    },
    Array(Box<Type>, u32),
    /// Name of a struct in [`Interface::structs`].
    Struct(String),
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    pub name: String,
    pub ty: Type,
    pub offset: u32,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Struct {
    pub name: String,
    pub members: Vec<Member>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    Sampled(&'static str),
    Storage(&'static str),
    Buffer,
    /// Name of the struct that holds the contents.
    Uniform(String),
    AccelerationStructure,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    Read,
    Write,
    ReadWrite,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    pub name: String,
    pub binding: u32,
    pub kind: Kind,
    pub access: Access,
    pub count: u32,
    /// Images: `Float`, `Uint` or `Sint`; else `None`.
    pub texel: &'static str,
    /// Storage images: format as SPIR-V numbers it; else 0.
    pub format: u32,
    /// Samplers: it compares depths, or reads single samples of a pixel.
    pub compares: bool,
}

/// Scalar type and name of a specialisation constant, with its default as bits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Spec {
    pub name: String,
    pub id: u32,
    pub ty: Type,
    pub default: u32,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Interface {
    pub bindings: Vec<Binding>,
    pub push: Option<Struct>,
    /// Inner structs first. Contents of storage buffers and of uniform blocks, and structs inside them.
    pub structs: Vec<Struct>,
    pub spec: Vec<Spec>,
    pub workgroup: [u32; 3],
    pub color_outputs: u32,
    /// Colour outputs: location, and `Float`, `Uint` or `Sint`; `None` for arrays and other types.
    pub outputs: Vec<(u32, &'static str)>,
    /// It declares that it traces by ray query, which not every device can.
    pub ray_query: bool,
}

#[derive(Clone, Debug)]
enum Raw {
    Bool,
    Float(u32),
    Int { width: u32, signed: bool },
    Vector(u32, u32),
    Matrix(u32, u32),
    Image { texel: u32, dim: u32, compares: bool, arrayed: bool, sampled: u32, format: u32 },
    SampledImage(u32),
    Array(u32, u32),
    RuntimeArray(u32),
    Struct(Vec<u32>),
    Pointer(u32),
    AccelerationStructure,
}

#[derive(Default)]
struct Walk {
    names: BTreeMap<u32, String>,
    member_names: BTreeMap<(u32, u32), String>,
    decorations: BTreeMap<(u32, u32), u32>,
    member_decorations: BTreeMap<(u32, u32, u32), u32>,
    types: BTreeMap<u32, Raw>,
    /// Value and result type of scalar constants; specialisation constants as well.
    constants: BTreeMap<u32, (u32, u32)>,
    variables: Vec<(u32, u32, u32)>,
    workgroup: [u32; 3],
    /// Constants of the workgroup's size, where the compiler names them instead of numbers; they are declared later.
    workgroup_ids: Option<[u32; 3]>,
    spec: Vec<u32>,
    ray_query: bool,
}

// Capabilities, decorations and storage classes of the SPIR-V specification that matter here.
const RAY_QUERY: u32 = 4472;
const SPEC_ID: u32 = 1;
/// Number and name of the specialisation constant that the engine sets itself (lib/trace_order.glsl); it is no part of a pass's interface.
pub const ENGINE_SPEC: (u32, &str) = (31, "TRACE_ORDERED");
const ARRAY_STRIDE: u32 = 6;
const MATRIX_STRIDE: u32 = 7;
const NON_WRITABLE: u32 = 24;
const NON_READABLE: u32 = 25;
const LOCATION: u32 = 30;
const BINDING: u32 = 33;
const DESCRIPTOR_SET: u32 = 34;
const OFFSET: u32 = 35;

fn string(words: &[u32]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).take_while(|b| *b != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

fn walk(words: &[u32]) -> Result<Walk, String> {
    let mut w = Walk { workgroup: [1; 3], ..Walk::default() };
    let mut at = 5;
    while at < words.len() {
        let (count, op) = ((words[at] >> 16) as usize, words[at] & 0xffff);
        let Some(a) = words.get(at + 1..at + count.max(1)).filter(|_| count > 0) else {
            return Err("malformed SPIR-V".into());
        };
        match op {
            5 => drop(w.names.insert(a[0], string(&a[1..]))),
            6 => drop(w.member_names.insert((a[0], a[1]), string(&a[2..]))),
            17 => w.ray_query |= a[0] == RAY_QUERY,
            16 if a[1] == 17 => w.workgroup = [a[2], a[3], a[4]],
            331 if a[1] == 38 => w.workgroup_ids = Some([a[2], a[3], a[4]]),
            20 => drop(w.types.insert(a[0], Raw::Bool)),
            21 => drop(w.types.insert(a[0], Raw::Int { width: a[1], signed: a[2] == 1 })),
            22 => drop(w.types.insert(a[0], Raw::Float(a[1]))),
            23 => drop(w.types.insert(a[0], Raw::Vector(a[1], a[2]))),
            24 => drop(w.types.insert(a[0], Raw::Matrix(a[1], a[2]))),
            25 => drop(w.types.insert(
                a[0],
                Raw::Image {
                    texel: a[1],
                    dim: a[2],
                    compares: a[3] == 1 || a[5] == 1,
                    arrayed: a[4] == 1,
                    sampled: a[6],
                    format: a[7],
                },
            )),
            27 => drop(w.types.insert(a[0], Raw::SampledImage(a[1]))),
            28 => drop(w.types.insert(a[0], Raw::Array(a[1], a[2]))),
            29 => drop(w.types.insert(a[0], Raw::RuntimeArray(a[1]))),
            30 => drop(w.types.insert(a[0], Raw::Struct(a[1..].to_vec()))),
            32 => drop(w.types.insert(a[0], Raw::Pointer(a[2]))),
            5341 => drop(w.types.insert(a[0], Raw::AccelerationStructure)),
            43 => drop(w.constants.insert(a[1], (a[2], a[0]))),
            48 | 49 => {
                w.constants.insert(a[1], (u32::from(op == 48), a[0]));
                w.spec.push(a[1]);
            }
            50 => {
                w.constants.insert(a[1], (a[2], a[0]));
                w.spec.push(a[1]);
            }
            59 => w.variables.push((a[0], a[1], a[2])),
            71 => drop(w.decorations.insert((a[0], a[1]), a.get(2).copied().unwrap_or(1))),
            72 => drop(w.member_decorations.insert((a[0], a[1], a[2]), a.get(3).copied().unwrap_or(1))),
            _ => {}
        }
        at += count;
    }
    if let Some(ids) = w.workgroup_ids {
        for (size, id) in w.workgroup.iter_mut().zip(ids) {
            *size = w.constants.get(&id).ok_or("the workgroup's size is not a constant")?.0;
        }
    }
    Ok(w)
}

impl Walk {
    fn decoration(&self, id: u32, which: u32) -> Option<u32> {
        self.decorations.get(&(id, which)).copied()
    }

    fn member(&self, id: u32, index: usize, which: u32) -> Option<u32> {
        self.member_decorations.get(&(id, index as u32, which)).copied()
    }

    fn name(&self, id: u32) -> String {
        self.names.get(&id).cloned().unwrap_or_default()
    }

    fn ty(&self, id: u32, place: &str, structs: &mut Vec<Struct>) -> Result<Type, String> {
        Ok(match self.types.get(&id) {
            Some(Raw::Float(32)) => Type::F32,
            Some(Raw::Int { width: 32, signed: true }) => Type::I32,
            Some(Raw::Int { width: 32, signed: false }) => Type::U32,
            Some(Raw::Vector(of, n)) => Type::Vector(Box::new(self.ty(*of, place, structs)?), *n),
            Some(Raw::Matrix(column, columns)) => match self.types.get(column) {
                Some(Raw::Vector(_, rows)) => Type::Matrix { rows: *rows, columns: *columns },
                _ => return Err(format!("{place}: matrix of an unexpected column type")),
            },
            Some(Raw::Array(of, length)) => {
                let of_type = self.ty(*of, place, structs)?;
                let length = self.constants.get(length).ok_or(format!("{place}: array length is not a constant"))?.0;
                let stride = self.decoration(id, ARRAY_STRIDE);
                let size = size_of(&of_type, structs);
                if stride != Some(size) {
                    return Err(format!(
                        "{place}: array stride {stride:?} is not the element size {size}; use layout(scalar)"
                    ));
                }
                Type::Array(Box::new(of_type), length)
            }
            Some(Raw::Struct(_)) => Type::Struct(self.structure(id, structs)?),
            Some(Raw::Bool) => return Err(format!("{place}: bool has no portable layout; use uint")),
            other => {
                return Err(format!(
                    "{place}: type {other:?} is not supported in a block; use 32-bit scalars, vectors, matrices"
                ));
            }
        })
    }

    /// Adds struct `id` and those inside it to `structs`, inner first. A trailing runtime array is left out.
    fn structure(&self, id: u32, structs: &mut Vec<Struct>) -> Result<String, String> {
        let name = self.name(id);
        if name.is_empty() {
            return Err("a struct has no name".into());
        }
        let built = self.members(id, &name, structs)?;
        match structs.iter().find(|s| s.name == name) {
            Some(known) if known.members == built => {}
            Some(_) => return Err(format!("two different structs are named {name}")),
            None => structs.push(Struct { name: name.clone(), members: built }),
        }
        Ok(name)
    }

    fn members(&self, id: u32, name: &str, structs: &mut Vec<Struct>) -> Result<Vec<Member>, String> {
        let Some(Raw::Struct(types)) = self.types.get(&id) else { return Err(format!("{name}: not a struct")) };
        let mut members = Vec::new();
        for (i, ty) in types.iter().enumerate() {
            if matches!(self.types.get(ty), Some(Raw::RuntimeArray(_))) {
                continue;
            }
            let member = self.member_names.get(&(id, i as u32)).cloned().unwrap_or_else(|| format!("member_{i}"));
            let place = format!("{name}.{member}");
            let ty = self.ty(*ty, &place, structs)?;
            if let Type::Matrix { rows, .. } = ty
                && self.member(id, i, MATRIX_STRIDE).is_some_and(|stride| stride != rows * 4)
            {
                return Err(format!("{place}: padded matrix columns; use layout(scalar)"));
            }
            members.push(Member { name: member, ty, offset: self.member(id, i, OFFSET).unwrap_or(0) });
        }
        Ok(members)
    }

    /// Element types of runtime arrays inside a buffer block become structs too, so that the CPU can fill the buffer.
    fn buffer_structs(&self, id: u32, structs: &mut Vec<Struct>) -> Result<(), String> {
        let Some(Raw::Struct(types)) = self.types.get(&id) else { return Ok(()) };
        for ty in types {
            let mut inner = *ty;
            while let Some(Raw::RuntimeArray(of) | Raw::Array(of, _)) = self.types.get(&inner) {
                inner = *of;
            }
            if matches!(self.types.get(&inner), Some(Raw::Struct(_))) {
                self.structure(inner, structs)?;
                if matches!(self.types.get(ty), Some(Raw::RuntimeArray(_))) {
                    self.check_stride(*ty, inner, structs)?;
                }
            }
        }
        Ok(())
    }

    fn check_stride(&self, array: u32, element: u32, structs: &[Struct]) -> Result<(), String> {
        let name = self.name(element);
        let size = size_of(&Type::Struct(name.clone()), structs);
        match self.decoration(array, ARRAY_STRIDE) {
            Some(stride) if stride == size => Ok(()),
            stride => {
                Err(format!("{name}[]: array stride {stride:?} is not the struct size {size}; use layout(scalar)"))
            }
        }
    }

    fn access(&self, variable: u32, block: Option<u32>) -> Access {
        let all = |which| {
            self.decoration(variable, which).is_some()
                || block.is_some_and(|id| match self.types.get(&id) {
                    Some(Raw::Struct(m)) => !m.is_empty() && (0..m.len()).all(|i| self.member(id, i, which).is_some()),
                    _ => false,
                })
        };
        match (all(NON_WRITABLE), all(NON_READABLE)) {
            (true, _) => Access::Read,
            (false, true) => Access::Write,
            (false, false) => Access::ReadWrite,
        }
    }
}

/// Bytes of a type in scalar layout.
pub fn size_of(ty: &Type, structs: &[Struct]) -> u32 {
    match ty {
        Type::F32 | Type::I32 | Type::U32 => 4,
        Type::Vector(of, n) => size_of(of, structs) * n,
        Type::Matrix { rows, columns } => 4 * rows * columns,
        Type::Array(of, n) => size_of(of, structs) * n,
        Type::Struct(name) => structs.iter().find(|s| s.name == *name).map_or(0, |s| struct_size(s, structs)),
    }
}

/// Bytes of a struct in scalar layout: end of its last member (all members are multiples of four bytes).
pub fn struct_size(s: &Struct, structs: &[Struct]) -> u32 {
    s.members.last().map_or(0, |m| m.offset + size_of(&m.ty, structs))
}

fn snake(name: &str) -> String {
    let mut out = String::new();
    for (i, c) in name.chars().enumerate() {
        if c.is_uppercase() && i > 0 {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}

fn dim(dim: u32, arrayed: bool) -> Result<&'static str, String> {
    Ok(match (dim, arrayed) {
        (0, false) => "D1",
        (1, false) => "D2",
        (1, true) => "D2Array",
        (2, false) => "D3",
        (3, false) => "Cube",
        (3, true) => "CubeArray",
        other => return Err(format!("image dimension {other:?} is not supported")),
    })
}

/// Reads the interface of one stage.
///
/// # Errors
/// What in the interface is not supported, by the name it has in the shader.
pub fn reflect(words: &[u32]) -> Result<Interface, String> {
    let w = walk(words)?;
    let mut interface = Interface { workgroup: w.workgroup, ray_query: w.ray_query, ..Interface::default() };
    for &(pointer, id, storage) in &w.variables {
        let Some(Raw::Pointer(pointee)) = w.types.get(&pointer).cloned() else { continue };
        match storage {
            3 => {
                if let Some(location) = w.decoration(id, LOCATION) {
                    interface.color_outputs = interface.color_outputs.max(location.saturating_add(1));
                    let of = match w.types.get(&pointee) {
                        Some(Raw::Vector(of, _)) => w.types.get(of),
                        other => other,
                    };
                    let texel = match of {
                        Some(Raw::Float(32)) => "Float",
                        Some(Raw::Int { width: 32, signed: false }) => "Uint",
                        Some(Raw::Int { width: 32, signed: true }) => "Sint",
                        _ => "None",
                    };
                    interface.outputs.push((location, texel));
                }
            }
            9 => {
                let members = w.members(pointee, "Push", &mut interface.structs)?;
                interface.push = Some(Struct { name: "Push".into(), members });
            }
            0 | 2 | 12 => {
                let binding = resource(&w, id, pointee, storage, &mut interface.structs)?;
                interface.bindings.push(binding);
            }
            _ => {}
        }
    }
    interface.outputs.sort_unstable();
    interface.bindings.sort_by_key(|b| b.binding);
    for pair in interface.bindings.windows(2) {
        if pair[0].binding == pair[1].binding {
            return Err(format!("{} and {} share binding {}", pair[0].name, pair[1].name, pair[0].binding));
        }
    }
    for &id in &w.spec {
        let Some(spec_id) = w.decoration(id, SPEC_ID) else { continue };
        let (engines, name) = ENGINE_SPEC;
        if (spec_id == engines) != (w.name(id) == name) {
            let found = w.name(id);
            return Err(format!(
                "{found}: constant_id {spec_id}; name and number {engines} belong to {name} of the engine"
            ));
        } else if spec_id == engines {
            continue;
        }
        let (default, ty) = w.constants[&id];
        let ty = match w.types.get(&ty) {
            Some(Raw::Bool) => return Err(format!("{}: a bool specialisation constant; use uint", w.name(id))),
            _ => w.ty(ty, &w.name(id), &mut Vec::new())?,
        };
        interface.spec.push(Spec { name: w.name(id).to_lowercase(), id: spec_id, ty, default });
    }
    interface.spec.sort_by_key(|s| s.id);
    Ok(interface)
}

fn resource(w: &Walk, id: u32, pointee: u32, storage: u32, structs: &mut Vec<Struct>) -> Result<Binding, String> {
    let (mut ty, mut count) = (pointee, 1);
    if let Some(Raw::Array(of, length)) = w.types.get(&ty) {
        count = w.constants.get(length).map_or(1, |c| c.0);
        ty = *of;
    }
    let mut name = w.name(id);
    if name.is_empty() {
        name = snake(&w.name(ty));
    }
    let set = w.decoration(id, DESCRIPTOR_SET).unwrap_or(0);
    let Some(binding) = w.decoration(id, BINDING) else { return Err(format!("{name}: has no layout(binding = …)")) };
    if set != 0 {
        return Err(format!("{name}: descriptor set {set}; only set 0 is used"));
    }
    let (kind, access) = match (storage, w.types.get(&ty)) {
        (0, Some(Raw::SampledImage(image))) => match w.types.get(image) {
            Some(Raw::Image { dim: d, arrayed, .. }) => (Kind::Sampled(dim(*d, *arrayed)?), Access::Read),
            _ => return Err(format!("{name}: unexpected sampler type")),
        },
        (0, Some(Raw::Image { dim: d, arrayed, sampled: 2, .. })) => {
            (Kind::Storage(dim(*d, *arrayed)?), w.access(id, None))
        }
        (0, Some(Raw::AccelerationStructure)) => (Kind::AccelerationStructure, Access::Read),
        (12, Some(Raw::Struct(_))) => {
            w.buffer_structs(ty, structs)?;
            (Kind::Buffer, w.access(id, Some(ty)))
        }
        (2, Some(Raw::Struct(members))) => {
            let single = match members.as_slice() {
                [one] if matches!(w.types.get(one), Some(Raw::Struct(_))) => Some(*one),
                _ => None,
            };
            if single.is_some() && w.name(id).is_empty() {
                name = w.member_names.get(&(ty, 0)).cloned().unwrap_or(name);
            }
            (Kind::Uniform(w.structure(single.unwrap_or(ty), structs)?), Access::Read)
        }
        _ => return Err(format!("{name}: separate images and samplers are not supported; use a combined sampler")),
    };
    let image = match w.types.get(&ty) {
        Some(Raw::SampledImage(image)) => w.types.get(image),
        other => other,
    };
    let compares = matches!(image, Some(Raw::Image { compares: true, .. }));
    let (texel, format) = match image {
        Some(Raw::Image { texel, format, .. }) => match w.types.get(texel) {
            Some(Raw::Int { signed: true, .. }) => ("Sint", *format),
            Some(Raw::Int { signed: false, .. }) => ("Uint", *format),
            _ => ("Float", *format),
        },
        _ => ("None", 0),
    };
    Ok(Binding { name, binding, kind, access, count, texel, format, compares })
}
