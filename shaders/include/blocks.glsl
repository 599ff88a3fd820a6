// Composes a block of pixels by `expose_frames`, which goes through the frames; for a median, once per scan.
void main() {
  if (!start_block()) {
    return;
  }
#if COMBINE == 3
  start_median();
  for (scan = 0; scan <= SCANS; scan++) {
    start_scan();
    expose_frames();
    end_scan();
  }
#else
  expose_frames();
#endif
  EACH(finish_quad);
}
