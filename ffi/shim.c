#include "shim.h"

#include <math.h>
#include <stddef.h>

#if defined(__SSE__)
#include <immintrin.h>
#endif

/* Embree 4.3 and newer read and write structs of these sizes; those of 4.2 are smaller. */
_Static_assert(RTC_VERSION >= 40300, "Embree 4.3 or newer is needed");
_Static_assert(sizeof(struct RTCRay) == 48, "size of RTCRay");
_Static_assert(sizeof(struct RTCHit) == 48, "size of RTCHit");
_Static_assert(sizeof(struct RTCRayHit) == 96, "size of RTCRayHit");
_Static_assert(sizeof(struct RTCRayHit4) == 336, "size of RTCRayHit4");
_Static_assert(sizeof(struct RTCRayHit8) == 672, "size of RTCRayHit8");
_Static_assert(sizeof(struct RTCRayHit16) == 1344, "size of RTCRayHit16");
_Static_assert(sizeof(struct RTCRayQueryContext) == 8, "size of RTCRayQueryContext");
_Static_assert(sizeof(TrRay) == 72, "size of TrRay");
_Static_assert(sizeof(TrSphere) == 32, "size of TrSphere");
_Static_assert(sizeof(TrQuery) == 40, "size of TrQuery");

unsigned tr_version_header(void) { return RTC_VERSION; }

/* Embree asks for flush-to-zero (0x8000) and denormals-are-zero (0x0040) on tracing threads. */
#if defined(__SSE__)
unsigned tr_mxcsr(void) { return _mm_getcsr(); }
unsigned tr_begin_tracing(void) {
  unsigned saved = _mm_getcsr();
  _mm_setcsr(saved | 0x8040u);
  return saved;
}
void tr_end_tracing(unsigned saved) { _mm_setcsr(saved); }
#else
unsigned tr_mxcsr(void) { return 0; }
unsigned tr_begin_tracing(void) { return 0; }
void tr_end_tracing(unsigned saved) { (void)saved; }
#endif

/* What callbacks need beside Embree's own context; the first member makes the cast valid. */
typedef struct Context {
  struct RTCRayQueryContext base;
  const TrQuery* query;
  /* MXCSR outside of tracing. */
  unsigned saved;
} Context;

static Context context_of(const TrQuery* query) {
  Context context;
  rtcInitRayQueryContext(&context.base);
  context.query = query;
  context.saved = 0;
  return context;
}

/* Words of a packet in Embree's structure-of-arrays layout, lane `i` of `n`; the header has
   accessors for C++ only. A hit packet follows its ray packet after 12 words a lane. */
enum { RAY_TFAR = 8, RAY_ID = 10, RAY_WORDS = 12 };
enum { HIT_NG_X, HIT_NG_Y, HIT_NG_Z, HIT_U, HIT_V, HIT_PRIM, HIT_GEOM, HIT_INST };

static float* float_at(void* packet, unsigned n, unsigned word, unsigned i) {
  return (float*)packet + (size_t)word * n + i;
}
static unsigned* id_at(void* packet, unsigned n, unsigned word, unsigned i) {
  return (unsigned*)packet + (size_t)word * n + i;
}
static const TrRay* original(const Context* context, void* rays, unsigned n, unsigned i) {
  return &context->query->rays[*id_at(rays, n, RAY_ID, i)];
}

static int has_passed(const TrQuery* query, unsigned geom, unsigned prim) {
  for (unsigned k = 0; k < query->passed_count; k++)
    if (query->passed[k].prim == prim && query->passed[k].geom == geom) return 1;
  return 0;
}

/* Whether the surface is there where ray number `id`, as it was asked for, meets it. Rust decides, so MXCSR
   must be what it is outside of tracing. */
static int is_there(const TrQuery* query, unsigned id, unsigned geom, unsigned prim, unsigned root) {
  TrPrim met = {geom, prim};
  return query->holes->is_there(query->holes, &query->asked[id], met, root);
}

/* Drops candidates where the surface has a hole. */
static void drop_holes(const struct RTCFilterFunctionNArguments* args) {
  const Context* context = (const Context*)args->context;
  tr_end_tracing(context->saved);
  for (unsigned i = 0; i < args->N; i++) {
    if (args->valid[i] != -1) continue;
    unsigned id = *id_at(args->ray, args->N, RAY_ID, i);
    unsigned prim = *id_at(args->hit, args->N, HIT_PRIM, i);
    unsigned geom = *id_at(args->hit, args->N, HIT_GEOM, i);
    if (!is_there(context->query, id, geom, prim, 0)) args->valid[i] = 0;
  }
  tr_begin_tracing();
}

void tr_set_holes(RTCGeometry geometry) {
  rtcSetGeometryIntersectFilterFunction(geometry, drop_holes);
  rtcSetGeometryOccludedFilterFunction(geometry, drop_holes);
}

/* Drops the primitive that a ray leaves, and those that it passed, from its candidates. */
static void drop_excluded(const struct RTCFilterFunctionNArguments* args) {
  const Context* context = (const Context*)args->context;
  for (unsigned i = 0; i < args->N; i++) {
    if (args->valid[i] != -1) continue;
    const TrRay* ray = original(context, args->ray, args->N, i);
    unsigned prim = *id_at(args->hit, args->N, HIT_PRIM, i);
    unsigned geom = *id_at(args->hit, args->N, HIT_GEOM, i);
    int leaves = ray->exclude_prim == prim && ray->exclude_geom == geom;
    if (leaves || has_passed(context->query, geom, prim)) args->valid[i] = 0;
  }
}

static enum RTCRayQueryFlags query_flags(unsigned flags) {
  int query = (flags & TR_COHERENT) ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  if (flags & TR_EXCLUDE) query |= RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
  return (enum RTCRayQueryFlags)query;
}

void tr_intersect(RTCScene scene, unsigned width, const int* valid, void* rayhits,
                  const TrQuery* query) {
  Context context = context_of(query);
  struct RTCIntersectArguments args;
  rtcInitIntersectArguments(&args);
  args.context = &context.base;
  args.flags = query_flags(query->flags);
  args.filter = (query->flags & TR_EXCLUDE) ? drop_excluded : NULL;
  context.saved = tr_begin_tracing();
  switch (width) {
    case 1: rtcIntersect1(scene, rayhits, &args); break;
    case 4: rtcIntersect4(valid, scene, rayhits, &args); break;
    case 8: rtcIntersect8(valid, scene, rayhits, &args); break;
    case 16: rtcIntersect16(valid, scene, rayhits, &args); break;
  }
  tr_end_tracing(context.saved);
}

void tr_occluded(RTCScene scene, unsigned width, const int* valid, void* packet,
                 const TrQuery* query) {
  Context context = context_of(query);
  struct RTCOccludedArguments args;
  rtcInitOccludedArguments(&args);
  args.context = &context.base;
  args.flags = query_flags(query->flags);
  args.filter = (query->flags & TR_EXCLUDE) ? drop_excluded : NULL;
  context.saved = tr_begin_tracing();
  switch (width) {
    case 1: rtcOccluded1(scene, packet, &args); break;
    case 4: rtcOccluded4(valid, scene, packet, &args); break;
    case 8: rtcOccluded8(valid, scene, packet, &args); break;
    case 16: rtcOccluded16(valid, scene, packet, &args); break;
  }
  tr_end_tracing(context.saved);
}

/* Spheres: the f64 test of src/intersect/sphere.rs on the f64 ray, so that Embree's spheres are
   as exact as the oracle's. */

static void sphere_bounds(const struct RTCBoundsFunctionArguments* args) {
  const TrSphere* s = (const TrSphere*)args->geometryUserPtr + args->primID;
  float lower[3], upper[3];
  if (s->radius < 0.0) {
    /* Embree leaves out what has no valid bounds. */
    args->bounds_o->lower_x = args->bounds_o->lower_y = args->bounds_o->lower_z = INFINITY;
    args->bounds_o->upper_x = args->bounds_o->upper_y = args->bounds_o->upper_z = -INFINITY;
    return;
  }
  for (int axis = 0; axis < 3; axis++) {
    /* Embree walks the f32 ray: the box must also hold what rounding the ray moves out of it. */
    double margin = 0x1p-20 * (fabs(s->centre[axis]) + s->radius);
    lower[axis] = nextafterf((float)(s->centre[axis] - s->radius - margin), -INFINITY);
    upper[axis] = nextafterf((float)(s->centre[axis] + s->radius + margin), INFINITY);
  }
  args->bounds_o->lower_x = lower[0];
  args->bounds_o->lower_y = lower[1];
  args->bounds_o->lower_z = lower[2];
  args->bounds_o->upper_x = upper[0];
  args->bounds_o->upper_y = upper[1];
  args->bounds_o->upper_z = upper[2];
}

static double dot(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* A sphere and a ray of a packet that may meet it. */
typedef struct Meeting {
  const Context* context;
  const TrSphere* sphere;
  /* Which ray of the query. */
  unsigned ray;
  unsigned geom;
  unsigned prim;
  double tnear;
  double tfar;
} Meeting;

/* Whether root number `which`, at `t`, is a hit. */
static int counts(const Meeting* m, unsigned which, double t) {
  const TrQuery* query = m->context->query;
  if (!(t >= m->tnear && t <= m->tfar)) return 0;
  if (!(query->flags & TR_SPHERE_HOLES)) return 1;
  tr_end_tracing(m->context->saved);
  int there = is_there(query, m->ray, m->geom, m->prim, which);
  tr_begin_tracing();
  return there;
}

/* The hit parameter in [tnear, tfar], or NaN. */
static double sphere_root(const Meeting* m, const TrRay* ray, int leaving) {
  const TrSphere* s = m->sphere;
  double a = dot(ray->dir, ray->dir);
  double to_centre[3], offset[3];
  for (int i = 0; i < 3; i++) to_centre[i] = s->centre[i] - ray->org[i];
  double middle = dot(to_centre, ray->dir) / a;
  for (int i = 0; i < 3; i++) offset[i] = to_centre[i] - ray->dir[i] * middle;
  double inside = s->radius * s->radius - dot(offset, offset);
  if (!(inside >= 0.0) || !isfinite(middle)) return NAN;
  double half_chord = sqrt(inside / a);
  double near_root = middle - half_chord, far_root = middle + half_chord;
  if (leaving) {
    unsigned which = fabs(near_root) > fabs(far_root) ? 0 : 1;
    double other = which == 0 ? near_root : far_root;
    return other > 0.0 && counts(m, which, other) ? other : NAN;
  }
  if (counts(m, 0, near_root)) return near_root;
  if (counts(m, 1, far_root)) return far_root;
  return NAN;
}

static double lane_root(void* rays, unsigned n, unsigned lane, const Context* context,
                        const TrSphere* spheres, unsigned geom, unsigned prim) {
  const TrRay* ray = original(context, rays, n, lane);
  if (has_passed(context->query, geom, prim)) return NAN;
  int leaving = ray->exclude_geom == geom && ray->exclude_prim == prim;
  double tfar = *float_at(rays, n, RAY_TFAR, lane);
  unsigned id = *id_at(rays, n, RAY_ID, lane);
  Meeting m = {context, &spheres[prim], id, geom, prim, ray->tnear, fmin(tfar, ray->tfar)};
  return sphere_root(&m, ray, leaving);
}

static void sphere_intersect(const struct RTCIntersectFunctionNArguments* args) {
  const Context* context = (const Context*)args->context;
  void* rays = args->rayhit;
  void* hits = float_at(rays, args->N, RAY_WORDS, 0);
  for (unsigned i = 0; i < args->N; i++) {
    if (args->valid[i] != -1) continue;
    double t = lane_root(rays, args->N, i, context, args->geometryUserPtr, args->geomID,
                         args->primID);
    if (isnan(t)) continue;
    *float_at(rays, args->N, RAY_TFAR, i) = (float)t;
    for (unsigned word = HIT_NG_X; word <= HIT_V; word++)
      *float_at(hits, args->N, word, i) = 0.0f;
    *id_at(hits, args->N, HIT_PRIM, i) = args->primID;
    *id_at(hits, args->N, HIT_GEOM, i) = args->geomID;
    *id_at(hits, args->N, HIT_INST, i) = RTC_INVALID_GEOMETRY_ID;
  }
}

static void sphere_occluded(const struct RTCOccludedFunctionNArguments* args) {
  const Context* context = (const Context*)args->context;
  for (unsigned i = 0; i < args->N; i++) {
    if (args->valid[i] != -1) continue;
    double t = lane_root(args->ray, args->N, i, context, args->geometryUserPtr, args->geomID,
                         args->primID);
    if (!isnan(t)) *float_at(args->ray, args->N, RAY_TFAR, i) = -INFINITY;
  }
}

void tr_set_spheres(RTCGeometry geometry, const TrSphere* spheres, unsigned count) {
  rtcSetGeometryUserPrimitiveCount(geometry, count);
  rtcSetGeometryUserData(geometry, (void*)spheres);
  rtcSetGeometryBoundsFunction(geometry, (RTCBoundsFunction)sphere_bounds, NULL);
  rtcSetGeometryIntersectFunction(geometry, sphere_intersect);
  rtcSetGeometryOccludedFunction(geometry, sphere_occluded);
}
