/* The C edge of tweenray: what Embree's header offers only as inline C. */
#ifndef TWEENRAY_SHIM_H
#define TWEENRAY_SHIM_H

#include <embree4/rtcore.h>

/* The version of the Embree header this was compiled with: major * 10000 + minor * 100 + patch. */
unsigned tr_version_header(void);

#endif
