/* The C edge of tweenray: what Embree's header offers only as inline C, and tracing with
   flush-to-zero set and restored (changing MXCSR from Rust is undefined behaviour). */
#ifndef TWEENRAY_SHIM_H
#define TWEENRAY_SHIM_H

#include <embree4/rtcore.h>

/* A ray as `tweenray::ray::Ray` lays it out: f64, scene space. */
typedef struct TrRay {
  double org[3];
  double dir[3];
  double tnear;
  double tfar;
  unsigned exclude_geom;
  unsigned exclude_prim;
} TrRay;

/* An analytic sphere as `tweenray::embree::SphereData` lays it out; negative radius: left out. */
typedef struct TrSphere {
  double centre[3];
  double radius;
} TrSphere;

/* A primitive as `tweenray::ray::PrimRef` lays it out. */
typedef struct TrPrim {
  unsigned geom;
  unsigned prim;
} TrPrim;

/* Flags of a query. TR_SPHERE_HOLES: some sphere has holes, so candidates of spheres ask for them, too. */
enum { TR_COHERENT = 1, TR_EXCLUDE = 2, TR_SPHERE_HOLES = 4 };

/* Decides where surfaces have holes, as `tweenray::embree::Registered` begins: whether `prim` is there
   where `ray` meets it, on a sphere at its first (0) or second (1) root. */
typedef struct TrHoles {
  _Bool (*is_there)(const struct TrHoles* self, const TrRay* ray, TrPrim prim, unsigned root);
} TrHoles;

/* What a query needs beside its packet, as `tweenray::embree::Query` lays it out. */
typedef struct TrQuery {
  /* The f64 originals; lane i of a packet stands for rays[id of lane i]. */
  const TrRay* rays;
  /* The same rays before they were moved or turned; read with holes only. */
  const TrRay* asked;
  /* Primitives that no ray of the packet may hit; read with TR_EXCLUDE only. */
  const TrPrim* passed;
  /* NULL in a scene without holes. */
  const TrHoles* holes;
  unsigned passed_count;
  unsigned flags;
} TrQuery;

/* The version of the Embree header this was compiled with: major * 10000 + minor * 100 + patch. */
unsigned tr_version_header(void);

/* Lets queries ask for holes in `geometry`, of triangles: their `holes` must not be NULL. */
void tr_set_holes(RTCGeometry geometry);

/* Turns `geometry` (a user geometry) into `count` analytic spheres, which must outlive it. */
void tr_set_spheres(RTCGeometry geometry, const TrSphere* spheres, unsigned count);

/* Closest hits of a packet. `width` is 1 (RTCRayHit), 4, 8 or 16; `valid` has `width` lanes of
   0 or -1 and is not read for 1. */
void tr_intersect(RTCScene scene, unsigned width, const int* valid, void* rayhits,
                  const TrQuery* query);

/* Occlusion of a packet (RTCRay, RTCRay4, ...): tfar is -inf afterwards where something is hit. */
void tr_occluded(RTCScene scene, unsigned width, const int* valid, void* packet,
                 const TrQuery* query);

/* MXCSR of the calling thread; 0 where there is none. */
unsigned tr_mxcsr(void);

/* Sets flush-to-zero for tracing and returns what MXCSR was, which the other one restores. */
unsigned tr_begin_tracing(void);
void tr_end_tracing(unsigned saved);

/* A camera as `tweenray::embree::BareCamera` lays it out: f32, scene space. */
typedef struct TrCamera {
  float eye[3];
  float forward[3];
  float half_right[3];
  float half_up[3];
  unsigned width;
  unsigned height;
} TrCamera;

typedef struct TrTally {
  unsigned long long hits;
  double sum_of_t;
} TrTally;

/* The benches' yardstick (bare_loop.c): one ray through the middle of every pixel, in packets of
   8, and nothing else. Width and height are multiples of 8; the scene has triangles only. */
TrTally tr_bare_camera_loop(RTCScene scene, const TrCamera* camera);

#endif
