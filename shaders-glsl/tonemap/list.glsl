// Workgroups over a list lie in rows of this many: Vulkan promises 65535 in one direction.
const uint LIST_ROW = 32768;  // export

uint list_group() {
    return gl_WorkGroupID.y * LIST_ROW + gl_WorkGroupID.x;
}
