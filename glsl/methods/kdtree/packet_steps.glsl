// The shared part of kd packets under the schedule `step`. The packet's state holds its node, its turns
// (drivers/packet_turns.glsl), and its place in the list of a leaf. Each ray's state holds the ray's place
// in the tree. The kernels of a packet are:
//   `traverse` visits a node.
//   `intersect` advances in the list of a leaf, after the rays have tested a triangle.
//   `leave` moves from a leaf to the next node.
//   `begin` begins the next turn at the root.
//
// A kernel loads the places of all rays and lets the rays vote, but stores only the packet's decision. A
// second pass repeats the kernel for each ray, and stores the ray's new place (packet_ray.glsl). For this
// pass, the fields `last` and `from` hold the last kernel and the node where it ran. The field `turns` has
// a bit for each turn that has not begun.
//
// The method's file for `step` defines `traverse` and `load_ray`. It also defines `clear_packet`,
// `load_packet` and `store_packet`, which handle the method's own fields in the packet's state.

void load_ray(int r);
void clear_packet();
void load_packet();
void store_packet();

// The texel of ray r. A ray beyond the edge of the ray textures never enters the tree, so it may load
// another ray's texel.
ivec2 own_texel(int r) {
    return min(ray_texel(r), ray_texture_size - 1);
}

void load_hit(int r) {
    hits[r] = hit_load(own_texel(r));
}

bool turn_has_begun(int r) {
    return (packet.turns >> octant[r] & 1) == 0;
}

void note_turn(int r) {
    packet.turns |= t_turn[r] != NEVER ? 1 << octant[r] : 0;
}

// Prepare the next turn, from the root, or end the traversal.
void end_turn() {
    node = 0;
    packet.phase = rays_wait() ? BEGIN : DONE;
}

void start_steps() {
    packet.cursor = packet.turn = packet.turns = packet.last = packet.from = 0;
    clear_packet();
    load_packet();
    start_packet();
    EACH(note_turn)
    end_turn();
}

void load_walk() {
    packet.last = packet.phase;
    packet.from = packet.node;
    node = packet.node;
    turn = packet.turn;
    load_packet();
    EACH(load_hit)
    EACH(load_ray)
}

void store_walk() {
    packet.node = node;
    store_packet();
}

void visit_leaf(int first, int count) {
    COUNT(nodes_visited);
    COUNT(leaves_visited);
    ++steps;
    packet.cursor = first;
    packet.phase = count > 0 ? INTERSECT : LEAVE;
}

void intersect() {
    COUNT_SEVERAL(triangles_tested, RAYS);
    ++steps;
    ++packet.cursor;
    int end = kd_node_left(node) + kd_node_count(node);
    packet.phase = packet.cursor < end ? INTERSECT : LEAVE;
}

void leave() {
    packet.phase = TRAVERSE;
    if (!leave_leaf()) {
        end_turn();
    }
}

void begin() {
    rays_wait();
    packet.turn = turn;
    packet.turns &= ~(1 << turn);
    packet.phase = TRAVERSE;
    begin_turn();
}
