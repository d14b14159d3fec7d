/* Traces rays by Embree 3 or 4 in its robust mode, in packets of 16 or 8 rays or ray by ray, on several threads.

   The rays have Embree's layout: blocks of W rays, each block an RTCRayW. A call copies each block to the stack,
   because Embree writes into rays; the copy stays in the cache. */
#include <pthread.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef HAVE_EMBREE_4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

enum { FIELDS = 12, CHUNK = 256 };   /* floats of a ray; blocks that a thread takes at a time */

typedef struct {
    RTCDevice device;
    RTCScene scene;
} Tracer;

typedef struct {
    RTCScene scene;
    const float *rays;      /* (blocks, FIELDS, width) */
    int *triangles;         /* (blocks * width): the triangle or -1, unless any_hit is set */
    unsigned char *hits;    /* (blocks * width): 1 or 0, whether the ray hits anything, if any_hit is set */
    size_t blocks;
    int width, any_hit, coherent;
    atomic_size_t next;
} Job;

void embree_close(Tracer *tracer)
{
    if (tracer->scene) rtcReleaseScene(tracer->scene);
    if (tracer->device) rtcReleaseDevice(tracer->device);
    tracer->scene = NULL;
    tracer->device = NULL;
}

/* Builds the scene. Returns Embree's error, 0 for none. */
int embree_open(Tracer *tracer, const float *corners, const unsigned *indices, size_t triangles, int threads)
{
    char config[32];
    snprintf(config, sizeof config, "threads=%d", threads);
    tracer->scene = NULL;
    tracer->device = rtcNewDevice(config);
    if (!tracer->device) return (int)rtcGetDeviceError(NULL);
    tracer->scene = rtcNewScene(tracer->device);
    rtcSetSceneFlags(tracer->scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(tracer->scene, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry mesh = rtcNewGeometry(tracer->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void *to = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                       3 * triangles);
    void *at = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned),
                                       triangles);
    if (to && at) {
        memcpy(to, corners, 9 * sizeof(float) * triangles);
        memcpy(at, indices, 3 * sizeof(unsigned) * triangles);
        rtcCommitGeometry(mesh);
        rtcAttachGeometry(tracer->scene, mesh);
        rtcCommitScene(tracer->scene);
    }
    rtcReleaseGeometry(mesh);
    return (int)rtcGetDeviceError(tracer->device);
}

#ifdef HAVE_EMBREE_4
#define ARGUMENTS(KIND, name) struct RTC##KIND##Arguments name; rtcInit##KIND##Arguments(&name); \
    name.flags = job->coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT
#define INTERSECT(W, one) rtcIntersect##W(valid, job->scene, &one, &nearest)
#define OCCLUDED(W, one) rtcOccluded##W(valid, job->scene, &one, &any)
#define INTERSECT_1(one) rtcIntersect1(job->scene, &one, &nearest)
#define OCCLUDED_1(one) rtcOccluded1(job->scene, &one, &any)
#else
#define INTERSECT(W, one) rtcIntersect##W(valid, job->scene, &context, &one)
#define OCCLUDED(W, one) rtcOccluded##W(valid, job->scene, &context, &one)
#define INTERSECT_1(one) rtcIntersect1(job->scene, &context, &one)
#define OCCLUDED_1(one) rtcOccluded1(job->scene, &context, &one)
#endif

/* Traces a block of W rays. Embree marks an occluded ray by tfar = -inf. */
#define BLOCK(W)                                                                                              \
    for (size_t b = first; b < last; ++b) {                                                                   \
        if (job->any_hit) {                                                                                   \
            struct RTCRay##W one;                                                                             \
            memcpy(&one, job->rays + b * FIELDS * W, sizeof(float) * FIELDS * W);                             \
            OCCLUDED(W, one);                                                                                 \
            for (int k = 0; k < W; ++k) job->hits[b * W + k] = one.tfar[k] < 0;                              \
        } else {                                                                                              \
            struct RTCRayHit##W one;                                                                          \
            memcpy(&one.ray, job->rays + b * FIELDS * W, sizeof(float) * FIELDS * W);                         \
            for (int k = 0; k < W; ++k) one.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;                          \
            INTERSECT(W, one);                                                                                \
            for (int k = 0; k < W; ++k)                                                                       \
                job->triangles[b * W + k] =                                                                   \
                    one.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID ? -1 : (int)one.hit.primID[k];               \
        }                                                                                                     \
    }

static void *work(void *given)
{
    Job *job = given;
    _Alignas(64) int valid[16];
    memset(valid, -1, sizeof valid);
#ifdef HAVE_EMBREE_4
    ARGUMENTS(Intersect, nearest);
    ARGUMENTS(Occluded, any);
#else
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = job->coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
#endif
    for (;;) {
        size_t first = atomic_fetch_add(&job->next, CHUNK);
        if (first >= job->blocks) return NULL;
        size_t last = first + CHUNK < job->blocks ? first + CHUNK : job->blocks;
        if (job->width == 16) {
            BLOCK(16)
        } else if (job->width == 8) {
            BLOCK(8)
        } else {
            for (size_t b = first; b < last; ++b) {
                struct RTCRayHit one;
                memcpy(&one.ray, job->rays + b * FIELDS, sizeof(float) * FIELDS);
                if (job->any_hit) {
                    OCCLUDED_1(one.ray);
                    job->hits[b] = one.ray.tfar < 0;
                } else {
                    one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
                    INTERSECT_1(one);
                    job->triangles[b] = one.hit.geomID == RTC_INVALID_GEOMETRY_ID ? -1 : (int)one.hit.primID;
                }
            }
        }
    }
}

/* Traces blocks of rays on this thread and `threads` - 1 others. */
void embree_trace(const Tracer *tracer, const float *rays, void *found, size_t blocks, int width, int any_hit,
                  int coherent, int threads)
{
    Job job = {tracer->scene, rays, found, found, blocks, width, any_hit, coherent, 0};
    pthread_t *others = malloc(sizeof *others * (size_t)threads);
    int started = 0;
    while (others && started < threads - 1 && !pthread_create(&others[started], NULL, work, &job)) ++started;
    work(&job);
    while (started) pthread_join(others[--started], NULL);
    free(others);
}
