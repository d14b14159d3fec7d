// The shared part of all packet walks through a BVH under the schedule `step`. It chooses the next turn
// (rays that walk together, drivers/packet_turns.glsl), and advances past each tested triangle of a leaf.
// The walks, packet_steps_stack.glsl and packet_steps_threads.glsl, define these functions:
//   `clear_place`, `load_place` and `store_place` access the fields that a walk needs besides the node.
//   `go_on` continues at `node` or at a popped node, or ends the walk.
//   `leave_leaf` continues after the last triangle of a leaf.
//   `traverse`, a kernel, visits a node. A walk may define further kernels.
//
// The field `turns` has a bit for each octant whose walk has not ended. All rays of an octant walk
// together. With INTERVAL_TEST, drivers/boxes_by_interval.glsl limits a turn to rays that begin near one
// another. This limit is left out here, because it needs more state.

void clear_place();
void load_place();
void store_place();
void leave_leaf();

void find_octant(int r) {
    packet.turns |= node_count > 0 && rays[r].t_min <= rays[r].t_max ? 1 << octant_of(rays[r]) : 0;
}

// Load a ray's hit. Set t_min to NEVER unless the ray belongs to the current turn and still searches.
void wake(int r) {
    hits[r] = hit_load(min(ray_texel(r), ray_texture_size - 1));
    bool awake = rays[r].t_min <= rays[r].t_max && octant_of(rays[r]) == turn && !search_over(hits[r]);
    rays[r].t_min = awake ? rays[r].t_min : NEVER;
    any_left = any_left || awake;
}

// Begin the next octant's walk at the root, or end the traversal.
void begin_walk() {
    packet.turn = 0;
    while (packet.turn < 8 && (packet.turns >> packet.turn & 1) == 0) {
        ++packet.turn;
    }
    turn = packet.turn;
    packet.phase = packet.turns == 0 ? DONE : TRAVERSE;
    start_walk();
}

void end_walk() {
    packet.turns &= ~(1 << packet.turn);
    begin_walk();
}

void start_steps() {
    packet.cursor = packet.turns = 0;
    clear_place();
    EACH(find_octant)
    begin_walk();
}

void load_walk() {
    node = packet.node;
    turn = packet.turn;
    load_place();
    any_left = false;
    EACH(wake)
    bound_rays();
}

void store_walk() {
    packet.node = node;
    store_place();
}

// Advance the cursor past the triangle that the rays have tested (drivers/packet_intersect.frag).
void intersect() {
    ++steps;
    COUNT_SEVERAL(triangles_tested, RAYS);
    bool last = triangle_last(packet.cursor) != 0;
    ++packet.cursor;
    if (!any_left) {
        end_walk();
    } else if (last) {
        COUNT(leaves_visited);
        leave_leaf();
    }
}
