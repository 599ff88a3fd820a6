// The graph's matrix times `values`, at node n. By differences: a diagonal that is rounded would leak like a ground.
// links: (node, weight) twice, a texel for every two links of a node; ranks: where the texels of a rank begin, and how
// many nodes have as many links. nodes: (diagonal, ground, parent).
vec4 applied(int n, int z)
{
  vec4 own = imageLoad(values, at(n, z));
  vec4 total = imageLoad(nodes, at(n, 0)).y * own;
  for (int k = 0; k < rank_count; k++) {
    vec4 rank = imageLoad(ranks, ivec3(k, 0, 0));
    if (n >= int(rank.y)) {
      break;
    }
    vec4 link = imageLoad(links, at(int(rank.x) + n, 0));
    total += link.y * (own - imageLoad(values, at(int(link.x), z)));
    total += link.w * (own - imageLoad(values, at(int(link.z), z)));
  }
  return total;
}
