// Rays through Embree, for the benchmark beside ours. Arguments: threads, rounds, triangles file, then a rays file for each set.
// Triangles: 9 floats each. Rays: origin, t_min, direction, t_max as floats. Prints for each set the least
// seconds of one pass of rtcOccluded1 and of rtcIntersect1, by the clock and by the processors, and how many rays hit.
#include <embree3/rtcore.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef struct { float origin[3], t_min, direction[3], t_max; } Ray;

static RTCScene scene;
static const Ray *rays;
static size_t count, threads;
static int any;
static size_t next_block, hits;
enum { BLOCK = 1024 };

static void *run(void *unused) {
    (void)unused;
    size_t found = 0;
    for (;;) {
        size_t first = __atomic_fetch_add(&next_block, BLOCK, __ATOMIC_RELAXED);
        if (first >= count) break;
        size_t last = first + BLOCK < count ? first + BLOCK : count;
        for (size_t i = first; i < last; ++i) {
            struct RTCIntersectContext context;
            rtcInitIntersectContext(&context);
            struct RTCRayHit q;
            q.ray.org_x = rays[i].origin[0]; q.ray.org_y = rays[i].origin[1]; q.ray.org_z = rays[i].origin[2];
            q.ray.dir_x = rays[i].direction[0]; q.ray.dir_y = rays[i].direction[1]; q.ray.dir_z = rays[i].direction[2];
            q.ray.tnear = rays[i].t_min; q.ray.tfar = rays[i].t_max;
            q.ray.mask = -1; q.ray.flags = 0; q.ray.time = 0;
            q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            q.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
            if (any) {
                rtcOccluded1(scene, &context, &q.ray);
                found += q.ray.tfar < 0;
            } else {
                rtcIntersect1(scene, &context, &q);
                found += q.hit.geomID != RTC_INVALID_GEOMETRY_ID;
            }
        }
    }
    __atomic_fetch_add(&hits, found, __ATOMIC_RELAXED);
    return 0;
}

static double now(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double pass(double *cpu) {
    pthread_t list[256];
    next_block = hits = 0;
    double start = now(CLOCK_MONOTONIC), busy = now(CLOCK_PROCESS_CPUTIME_ID);
    for (size_t i = 1; i < threads; ++i) pthread_create(&list[i], 0, run, 0);
    run(0);
    for (size_t i = 1; i < threads; ++i) pthread_join(list[i], 0);
    *cpu = fmin(*cpu, now(CLOCK_PROCESS_CPUTIME_ID) - busy);
    return now(CLOCK_MONOTONIC) - start;
}

static void *load(const char *path, size_t *bytes) {
    FILE *file = fopen(path, "rb");
    if (!file) exit(2);
    fseek(file, 0, SEEK_END);
    *bytes = (size_t)ftell(file);
    rewind(file);
    void *data = malloc(*bytes + 64);
    if (!data || fread(data, 1, *bytes, file) != *bytes) exit(2);
    fclose(file);
    return data;
}

int main(int argc, char **argv) {
    if (argc < 5) return 2;
    threads = (size_t)atoi(argv[1]);
    int rounds = atoi(argv[2]);
    size_t bytes;
    float *triangles = load(argv[3], &bytes);
    size_t n = bytes / 36;
    char config[64];
    snprintf(config, sizeof config, "threads=%zu", threads);
    RTCDevice device = rtcNewDevice(config);
    scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *v = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3 * n);
    unsigned *index = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, n);
    for (size_t i = 0; i < 9 * n; ++i) v[i] = triangles[i];
    for (size_t i = 0; i < 3 * n; ++i) index[i] = (unsigned)i;
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    double start = now(CLOCK_MONOTONIC);
    rtcCommitScene(scene);
    printf("build %g\n", now(CLOCK_MONOTONIC) - start);
    for (int set = 4; set < argc; ++set) {
        rays = load(argv[set], &bytes);
        count = bytes / sizeof(Ray);
        for (any = 1; any >= 0; --any) {
            double best = INFINITY, cpu = INFINITY;
            for (int i = 0; i < rounds; ++i) best = fmin(best, pass(&cpu));
            printf("%g %g %zu ", best, cpu, hits);
        }
        printf("\n");
    }
    return 0;
}
