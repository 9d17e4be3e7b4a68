//! `Args` of passes that trace rays and light what they meet.

/// As [`traced!`](crate::rays::traced), with the environment and the pass's settings from `shared`; with `lamps` in the last place also the
/// bindings of `lib/lights.glsl` and `lib/light_sampling.glsl`.
macro_rules! traced_lit {
    ($($name:ident)::+ { $($fields:tt)* }, $rays:expr, $handles:expr, $shared:expr $(,)?) => {
        $crate::rays::traced!(
            $($name)::+ {
                environment_radiance_map: $shared.environment,
                environment_columns: $shared.environment_columns,
                settings: $shared.settings,
                $($fields)*
            },
            $rays,
            $handles
        )
    };
    ($($name:ident)::+ { $($fields:tt)* }, $rays:expr, $handles:expr, $shared:expr, lamps $(,)?) => {
        traced_lit!(
            $($name)::+ {
                light_columns: $shared.light_columns,
                light_targets: $shared.light_targets,
                instance_lights: $shared.instance_lights,
                light_nodes: $shared.light_nodes,
                lights: $handles.lights,
                $($fields)*
            },
            $rays,
            $handles,
            $shared
        )
    };
}
