// The next operator PᵀAP, given add_row(i, at, weight, product): adds row i of A, whose cell is number `at` of the 25
// cells 2p − 2 … 2p + 2.
void main()
{
  ivec2 p = corner(coarse) + in_fours();
  if (!inside(p, coarse)) {
    return;
  }
  float row[9];
  for (int k = 0; k < 9; k++) {
    row[k] = 0.0;
  }
  float product[25];
  for (int n = 0; n < 25; n++) {
    product[n] = 0.0;
  }
  for (int k = 0; k < 9; k++) {
    ivec2 i = 2 * p + OFFSET(k);
    if (inside(i, size)) {
      add_row(i, 5 * (k / 3 + 1) + k % 3 + 1, imageLoad(weights, ivec3(i, 0))[TAKES(k)], product);
    }
  }
  for (int n = 0; n < 25; n++) {
    ivec2 j = 2 * p + ivec2(n % 5, n / 5) - 2;
    if (inside(j, size)) {
      vec4 value = product[n] * imageLoad(weights, ivec3(j, 0));
      int a = n % 5 / 2;
      int b = (n % 5 + 1) / 2;
      int above = 3 * (n / 5 / 2);
      int below = 3 * ((n / 5 + 1) / 2);
      row[above + a] += value.x;
      row[above + b] += value.y;
      row[below + a] += value.z;
      row[below + b] += value.w;
    }
  }
  imageStore(next, ivec3(p, 0), vec4(row[0], row[1], row[2], row[3]));
  imageStore(next, ivec3(p, 1), vec4(row[5], row[6], row[7], row[8]));
  imageStore(next, ivec3(p, 2), vec4(row[4] > 1e-6 ? 1.0 / row[4] : 0.0, row[4], 0.0, 0.0));
}
