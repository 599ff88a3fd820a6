// The next operator PᵀAP. The pass has product[25] and add_row(i, at, weight): adds row i of A to the product, whose cell
// is number `at` of the 25 cells 2p − 2 … 2p + 2.
ivec2 p;
float row[9];

void add_equation(int k)
{
  ivec2 i = 2 * p + OFFSET(k);
  if (inside(i, size)) {
    add_row(i, AMONG_25(k), imageLoad(weights, ivec3(i, 0))[TAKES(k)]);
  }
}

void add_column(int n)
{
  ivec2 j = 2 * p + OFFSET_OF_25(n);
  vec4 value = inside(j, size) ? product[n] * imageLoad(weights, ivec3(j, 0)) : vec4(0.0);
  int a = n % 5 / 2;
  int b = (n % 5 + 1) / 2;
  int above = 3 * (n / 5 / 2);
  int below = 3 * ((n / 5 + 1) / 2);
  row[above + a] += value.x;
  row[above + b] += value.y;
  row[below + a] += value.z;
  row[below + b] += value.w;
}

void clear_entry(int k)
{
  row[k] = 0.0;
}

void clear_product(int n)
{
  product[n] = 0.0;
}

void main()
{
  p = corner(coarse) + in_fours();
  if (!inside(p, coarse)) {
    return;
  }
  EACH_OF_9(clear_entry);
  EACH_OF_25(clear_product);
  EACH_OF_9(add_equation);
  EACH_OF_25(add_column);
  imageStore(next, ivec3(p, 0), vec4(row[0], row[1], row[2], row[3]));
  imageStore(next, ivec3(p, 1), vec4(row[5], row[6], row[7], row[8]));
  imageStore(next, ivec3(p, 2), vec4(row[4] > 1e-6 ? 1.0 / row[4] : 0.0, row[4], 0.0, 0.0));
}
