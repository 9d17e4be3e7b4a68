//! The two variants of a pass that traces rays, in compute and by ray query, and what they share.

use super::{
    codegen::Pass,
    reflect::{Access, Binding},
};

/// A binding after merging the stages of a pass.
pub struct Merged<'a> {
    pub binding: &'a Binding,
    pub access: Access,
    pub stages: Vec<&'static str>,
}

/// The bindings of all stages of one variant.
pub fn merge<'a>(pass: &'a Pass, query: bool) -> Result<Vec<Merged<'a>>, String> {
    let mut merged: Vec<Merged> = Vec::new();
    for stage in &pass.stages {
        for b in &stage.variant(query).0.bindings {
            match merged.iter_mut().find(|m| m.binding.binding == b.binding) {
                None => merged.push(Merged { binding: b, access: b.access, stages: vec![stage.stage] }),
                Some(m) if m.binding.name == b.name && m.binding.kind == b.kind && m.binding.count == b.count => {
                    m.stages.push(stage.stage);
                    if m.access != b.access {
                        m.access = Access::ReadWrite;
                    }
                }
                Some(m) => {
                    return Err(format!(
                        "binding {} is {} in one stage and {} in the other; number bindings over both stages",
                        b.binding, m.binding.name, b.name
                    ));
                }
            }
        }
    }
    merged.sort_by_key(|m| m.binding.binding);
    for (i, m) in merged.iter().enumerate() {
        if merged[..i].iter().any(|other| other.binding.name == m.binding.name) {
            return Err(format!("two bindings are named {}", m.binding.name));
        }
    }
    Ok(merged)
}

/// A binding of either variant or of both.
pub struct Field<'a> {
    pub binding: &'a Binding,
    pub access: Access,
    pub compute: bool,
    pub query: bool,
}

/// The bindings of both variants; what both have must be the same in both.
pub fn unite<'a>(compute: &[Merged<'a>], query: &[Merged<'a>]) -> Result<Vec<Field<'a>>, String> {
    let mut fields: Vec<Field> = Vec::new();
    for (list, is_query) in [(compute, false), (query, true)] {
        for m in list {
            let b = m.binding;
            match fields.iter_mut().find(|f| f.binding.binding == b.binding || f.binding.name == b.name) {
                None => {
                    fields.push(Field { binding: b, access: m.access, compute: !is_query, query: is_query });
                }
                Some(f)
                    if f.binding.binding == b.binding
                        && f.binding.name == b.name
                        && f.binding.kind == b.kind
                        && f.binding.count == b.count =>
                {
                    f.query = true
                }
                Some(f) => {
                    return Err(format!(
                        "binding {} {} in compute and binding {} {} by ray query differ; both variants share Args",
                        f.binding.binding, f.binding.name, b.binding, b.name
                    ));
                }
            }
        }
    }
    fields.sort_by_key(|f| f.binding.binding);
    Ok(fields)
}

/// What both variants must have in common, and what tells them apart.
pub fn check_variants(pass: &Pass) -> Result<(), String> {
    for stage in &pass.stages {
        let Some((query, _)) = &stage.query else { continue };
        let compute = &stage.interface;
        if compute.push != query.push
            || compute.spec != query.spec
            || compute.workgroup != query.workgroup
            || compute.color_outputs != query.color_outputs
        {
            return Err(
                "push constants, specialisation constants, workgroup or outputs differ when tracing by ray query"
                    .into(),
            );
        }
        if compute.ray_query {
            return Err("the variant for every device traces by ray query, which not every device can".into());
        }
    }
    Ok(())
}
