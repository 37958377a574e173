/* The yardstick of benches/intersect.rs: as little as one can do around Embree for a camera's
   rays. Packets of 8, coherent, MXCSR set once, rays made in f32 on the spot. */
#include "shim.h"

#include <math.h>

/* Blocks of 8 x 8 pixels made of 4 x 4 sub-blocks, as src/shade/pixels.rs has them; a packet is
   two rows of a sub-block. */
enum { BLOCK = 8, LANES = 8, PACKETS = BLOCK * BLOCK / LANES };

/* Embree does not write what camera rays never change, so these are set once. */
static void prepare(struct RTCRayHit8* packet, const TrCamera* c) {
  for (unsigned i = 0; i < LANES; i++) {
    packet->ray.org_x[i] = c->eye[0];
    packet->ray.org_y[i] = c->eye[1];
    packet->ray.org_z[i] = c->eye[2];
    packet->ray.tnear[i] = 0.0f;
    packet->ray.time[i] = 0.0f;
    packet->ray.mask[i] = 0xffffffffu;
    packet->ray.id[i] = i;
    packet->ray.flags[i] = 0;
    packet->hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
}

static void aim(struct RTCRayHit8* packet, const TrCamera* c, unsigned x0, unsigned y0) {
  float per_x = 2.0f / (float)c->width, per_y = 2.0f / (float)c->height;
  for (unsigned i = 0; i < LANES; i++) {
    float sx = ((float)(x0 + i % 4) + 0.5f) * per_x - 1.0f;
    float sy = 1.0f - ((float)(y0 + i / 4) + 0.5f) * per_y;
    float x = c->forward[0] + c->half_right[0] * sx + c->half_up[0] * sy;
    float y = c->forward[1] + c->half_right[1] * sx + c->half_up[1] * sy;
    float z = c->forward[2] + c->half_right[2] * sx + c->half_up[2] * sy;
    float scale = 1.0f / sqrtf(x * x + y * y + z * z);
    packet->ray.dir_x[i] = x * scale;
    packet->ray.dir_y[i] = y * scale;
    packet->ray.dir_z[i] = z * scale;
    packet->ray.tfar[i] = INFINITY;
    packet->hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }
}

static void count(const struct RTCRayHit8* packet, TrTally* tally) {
  for (unsigned i = 0; i < LANES; i++) {
    if (packet->hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    tally->hits++;
    tally->sum_of_t += packet->ray.tfar[i];
  }
}

TrTally tr_bare_camera_loop(RTCScene scene, const TrCamera* camera) {
  struct RTCRayQueryContext context;
  rtcInitRayQueryContext(&context);
  struct RTCIntersectArguments args;
  rtcInitIntersectArguments(&args);
  args.context = &context;
  args.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  _Alignas(32) const int valid[LANES] = {-1, -1, -1, -1, -1, -1, -1, -1};
  struct RTCRayHit8 packet;
  prepare(&packet, camera);
  TrTally tally = {0, 0.0};
  unsigned saved = tr_begin_tracing();
  for (unsigned y = 0; y < camera->height; y += BLOCK)
    for (unsigned x = 0; x < camera->width; x += BLOCK)
      for (unsigned k = 0; k < PACKETS; k++) {
        aim(&packet, camera, x + k / 2 % 2 * 4, y + k / 4 * 4 + k % 2 * 2);
        rtcIntersect8(valid, scene, &packet, &args);
        count(&packet, &tally);
      }
  tr_end_tracing(saved);
  return tally;
}
