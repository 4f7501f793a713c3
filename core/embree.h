#pragma once
// Embree 3 (Debian 12) and 4 (Debian 13): the differences that matter here. Link scanrig::embree.

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace scanrig {

/// A device, or null where Embree cannot create one. The thread sanitizer cannot follow how Embree's threads hand work
/// to each other. Under it the calling thread builds the scenes.
inline RTCDevice new_embree_device() {
#ifdef __SANITIZE_THREAD__
  return rtcNewDevice("threads=1");
#else
  return rtcNewDevice(nullptr);
#endif
}

/// Writes the first triangle hit by `ray` into it. ray.hit.geomID must be RTC_INVALID_GEOMETRY_ID beforehand.
inline void intersect(RTCScene scene, RTCRayHit& ray) {
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect1(scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &ray);
#endif
}

/// Whether any triangle lies on `ray` before its end.
inline bool occluded(RTCScene scene, RTCRay& ray) {
#if RTC_VERSION_MAJOR >= 4
  rtcOccluded1(scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
#endif
  return ray.tfar < 0.0F;
}

}  // namespace scanrig
