#include "shim.h"

/* Embree 4.3 and newer read and write structs of these sizes; those of 4.2 are smaller. */
_Static_assert(RTC_VERSION >= 40300, "Embree 4.3 or newer is needed");
_Static_assert(sizeof(struct RTCRay) == 48, "size of RTCRay");
_Static_assert(sizeof(struct RTCHit) == 48, "size of RTCHit");
_Static_assert(sizeof(struct RTCRayHit) == 96, "size of RTCRayHit");
_Static_assert(sizeof(struct RTCRayHit4) == 336, "size of RTCRayHit4");
_Static_assert(sizeof(struct RTCRayHit8) == 672, "size of RTCRayHit8");
_Static_assert(sizeof(struct RTCRayHit16) == 1344, "size of RTCRayHit16");
_Static_assert(sizeof(struct RTCRayQueryContext) == 8, "size of RTCRayQueryContext");

unsigned tr_version_header(void) { return RTC_VERSION; }
