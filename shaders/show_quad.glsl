// A piece of the picture on the region. `corner`: in the region's pixels; `place`: in the picture, y up.
void main()
{
  at = place;
  gl_Position = ModelViewProjectionMatrix * vec4(corner, 0.0, 1.0);
}
