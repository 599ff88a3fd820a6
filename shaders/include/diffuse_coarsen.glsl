// Row p of the next operator PᵀAP from `product`, the row of PᵀA on the cells 2p − 2 … 2p + 2 of the finer grid.
void store_row(ivec2 p, float product[25])
{
  float row[9];
  for (int k = 0; k < 9; k++) {
    row[k] = 0.0;
  }
  for (int n = 0; n < 25; n++) {
    ivec2 j = 2 * p + ivec2(n % 5, n / 5) - 2;
    if (inside(j, size)) {
      float value = 0.25 * product[n] * scale(j);
      ivec2 a = j / 2 - p + 1;
      ivec2 b = min((j + 1) / 2, coarse - 1) - p + 1;
      row[3 * a.y + a.x] += value;
      row[3 * a.y + b.x] += value;
      row[3 * b.y + a.x] += value;
      row[3 * b.y + b.x] += value;
    }
  }
  float sum = 0.0;
  for (int k = 0; k < 9; k++) {
    sum += row[k];
  }
  float inverse = row[4] > 0.0 ? 1.0 / row[4] : 0.0;
  float follow = row[4] > 0.0 ? max(0.0, 1.0 - hold * sum * inverse) : 0.0;
  imageStore(next, ivec3(p, 0), vec4(row[0], row[1], row[2], row[3]));
  imageStore(next, ivec3(p, 1), vec4(row[5], row[6], row[7], row[8]));
  imageStore(next, ivec3(p, 2), vec4(inverse, follow, row[4], 0.0));
}
