// Chooses the node at which a packet begins its walk. A beam around the packet's tile has found an entry: a
// start node and four links to later nodes of the walk (stages/packet_entries.frag). If the beam contains
// all rays of the turn (packet_turns.glsl), the packet begins at the start node, else at the root. Two
// files use the links (methods/bvh/entry_stack.glsl, methods/bvh/entry_threads.glsl).

Packet_entry entry;
bool within;

void see_within(vec3 a, vec3 b, vec3 inv_lo, vec3 inv_hi, float t_min) {
    within = within && entry.t_min <= t_min
        && all(greaterThanEqual(inv_lo, entry.inv_lo))
        && all(lessThanEqual(inv_hi, entry.inv_hi));
#ifndef RAYS_TEXEL_0_UNIFORM
    within = within && all(lessThanEqual(max(a, b), entry.lo_origin))
        && all(greaterThanEqual(min(a, b), entry.hi_origin));
#endif
}

void see_ray(int r) {
    Ray ray = rays[r];
    if (PRESENT(r)) {
        see_within(ray.lo_origin, ray.hi_origin, ray.inv_dir, ray.inv_dir, ray.t_min);
    }
}

int first_node(int root) {
    entry = packet_entry_load(ivec2(gl_FragCoord.xy) * PACKET_SIZE / ENTRY_TILE);
    within = entry.start != NO_LINK;
#ifdef INTERVAL_TEST
    see_within(first_origin, last_origin, inv_lo, inv_hi, t_first);
#else
    EACH(see_ray)
#endif
    entry.link_1 = within ? entry.link_1 : NO_LINK;
    entry.link_2 = within ? entry.link_2 : NO_LINK;
    entry.link_3 = within ? entry.link_3 : NO_LINK;
    entry.link_4 = within ? entry.link_4 : NO_LINK;
    return within ? entry.start : root;
}
