//! `Args` of passes that trace rays, with the bindings filled in.

/// `Args` with the given fields. Fills in the bindings of `lib/trace.glsl` and `lib/material.glsl` from `rays`
/// ([`RayHandles`](crate::rays::RayHandles)) and, if the scene's `handles` are given, the bindings of `lib/hit_surface.glsl`.
macro_rules! traced {
    ($($name:ident)::+ { $($fields:tt)* }, $rays:expr $(,)?) => {{
        let rays: $crate::rays::RayHandles = $rays;
        $($name)::+ {
            materials: rays.materials,
            scene_textures: rays.scene_textures,
            trace_nodes: rays.trace_nodes,
            trace_triangles: rays.trace_triangles,
            trace_instances: rays.trace_instances,
            scene_at: rays.scene_at,
            trace_indices: rays.trace_indices,
            trace_uvs: rays.trace_uvs,
            trace_colors: rays.trace_colors,
            trace_scene: rays.trace_scene,
            trace_accel: rays.trace_accel,
            $($fields)*
        }
    }};
    ($($name:ident)::+ { $($fields:tt)* }, $rays:expr, $handles:expr $(,)?) => {
        $crate::rays::traced!(
            $($name)::+ {
                surface_instances: $handles.instances,
                surface_indices: $handles.indices,
                surface_positions: $handles.positions,
                surface_normals: $handles.normals,
                surface_tangents: $handles.tangents,
                surface_uvs: $handles.uvs,
                surface_colors: $handles.colors,
                $($fields)*
            },
            $rays
        )
    };
}

pub(crate) use traced;
