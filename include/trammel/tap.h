/* trammel's contact height of a load-cell tap, for C and whatever calls C.
 *
 * C99, stable: structs only grow at their end, and their size, which the caller writes into their
 * first field, says how much of them the caller knows. Nothing is allocated, printed or kept; no
 * function throws; all may be called from several threads, each with a workspace of its own.
 *
 *     trammel_tap_options options;
 *     trammel_tap_result result;
 *     trammel_tap_default_options(&options, sizeof options);
 *     result.struct_size = sizeof result;
 *     size_t bytes = trammel_tap_workspace_bytes(samples);
 *     trammel_tap_status status = trammel_tap_analyse(time_s, force_g, samples, moves, move_count,
 *                                                     &options, workspace, bytes, &result);
 */
#ifndef TRAMMEL_TAP_H
#define TRAMMEL_TAP_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__) && defined(TRAMMEL_TAP_BUILD)
#define TRAMMEL_TAP_API __attribute__((visibility("default")))
#else
#define TRAMMEL_TAP_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Grows with what is added; the library's own is trammel_tap_version(). */
#define TRAMMEL_TAP_VERSION 2

/* A piece of motion along Z, as Klipper's trapezoid queue holds it:
 * z(t) = start_z + direction (start_velocity dt + acceleration dt^2 / 2). */
typedef struct trammel_tap_move {
  double start_time_s; /* On the clock of the samples. */
  double duration_s;
  double start_velocity_mm_s;
  double acceleration_mm_s2;
  double start_z_mm;
  double z_direction; /* -1 down, +1 up, 0 at rest. */
} trammel_tap_move;

enum { TRAMMEL_TAP_METHOD_CONTACT = 0, TRAMMEL_TAP_METHOD_TWO_LINE = 1 };

typedef struct trammel_tap_options {
  size_t struct_size;
  int32_t method; /* TRAMMEL_TAP_METHOD_… */
  int32_t reserved;
  double latency_s;               /* By which a sample's time is after its force acted, -10 … 10;
                                     below 0 where a host dates samples too early (version 2). NaN
                                     where it is not known: the contact method takes it from the
                                     approach. */
  double latency_uncertainty_s;   /* Standard uncertainty of a stated latency; >= 0. */
  double nozzle_temperature_c;    /* NaN where it is not known. */
  double trigger_force_g;         /* NaN where it is not known. */
  double decompression_angle_rad; /* Of a clean nozzle at 25 gf = 0.1 s; NaN leaves it out. */
} trammel_tap_options;

enum {
  TRAMMEL_TAP_GOOD = 0,        /* A value with its uncertainty. */
  TRAMMEL_TAP_CANNOT_TELL = 1, /* The data are sound but do not determine the value. */
  TRAMMEL_TAP_REFUSED = 2      /* The data are not fit to be measured. */
};

/* A reason or a notice: a code with its figure and the limit that it was held against. */
typedef struct trammel_tap_finding {
  int32_t code; /* 0 for none; its name, not its number, is stable. */
  int32_t reserved;
  double figure;
  double limit;
} trammel_tap_finding;

enum {
  TRAMMEL_TAP_APPROACH_START = 0,
  TRAMMEL_TAP_COLLISION = 1,
  TRAMMEL_TAP_PRESS_END = 2,
  TRAMMEL_TAP_DWELL_END = 3,
  TRAMMEL_TAP_DECOMPRESSION_SPLIT = 4,
  TRAMMEL_TAP_BREAK = 5,
  TRAMMEL_TAP_PULL_BACK_END = 6
};

/* A corner of the force curve. */
typedef struct trammel_tap_point {
  int32_t corner;
  int32_t reserved;
  double time_s;
  double z_mm;
  double force_g;
} trammel_tap_point;

#define TRAMMEL_TAP_MAX_POINTS 8
#define TRAMMEL_TAP_MAX_NOTICES 16

typedef struct trammel_tap_result {
  size_t struct_size; /* Written by the caller: sizeof(trammel_tap_result). */
  int32_t verdict;
  int32_t method;
  trammel_tap_finding reason; /* Why, where the verdict is not good. */
  /* The next five are NaN unless the verdict is good. */
  double contact_z_mm;
  double contact_time_s;
  double standard_uncertainty_mm; /* k = 1 */
  double interval95_lo_mm;
  double interval95_hi_mm;
  double quality; /* 0 … 100, NaN where it is not known. */
  double noise_g;
  int32_t point_count;
  int32_t notice_count;
  trammel_tap_point points[TRAMMEL_TAP_MAX_POINTS];
  trammel_tap_finding notices[TRAMMEL_TAP_MAX_NOTICES];
} trammel_tap_result;

typedef enum trammel_tap_status {
  TRAMMEL_TAP_OK = 0,              /* result says what came of it. */
  TRAMMEL_TAP_BAD_ARGUMENT = 1,    /* A pointer is null, a size or an option out of range. */
  TRAMMEL_TAP_SMALL_WORKSPACE = 2, /* See trammel_tap_workspace_bytes. */
  TRAMMEL_TAP_BUG = 3              /* Of the library; please report it. */
} trammel_tap_status;

/* TRAMMEL_TAP_VERSION of the library. */
TRAMMEL_TAP_API int32_t trammel_tap_version(void);

/* Bytes of workspace that suffice for so many samples; any alignment will do. */
TRAMMEL_TAP_API size_t trammel_tap_workspace_bytes(size_t samples);

/* The defaults, as far as options_size reaches; writes struct_size. */
TRAMMEL_TAP_API void trammel_tap_default_options(trammel_tap_options* options, size_t options_size);

/* Analyses one tap. time_s and force_g hold `samples` numbers each, on one clock with the moves;
 * whatever they hold, the answer is a result. options may be null for the defaults. */
TRAMMEL_TAP_API trammel_tap_status trammel_tap_analyse(
    const double* time_s, const double* force_g, size_t samples, const trammel_tap_move* moves,
    size_t move_count, const trammel_tap_options* options, void* workspace, size_t workspace_bytes,
    trammel_tap_result* result);

/* Names as in trammel's JSON; "" for what does not exist. Never null, valid for ever. */
TRAMMEL_TAP_API const char* trammel_tap_verdict_name(int32_t verdict);
TRAMMEL_TAP_API const char* trammel_tap_method_name(int32_t method);
TRAMMEL_TAP_API const char* trammel_tap_finding_name(int32_t code);
TRAMMEL_TAP_API const char* trammel_tap_corner_name(int32_t corner);
TRAMMEL_TAP_API const char* trammel_tap_status_name(trammel_tap_status status);

/* A sentence with the figure, its limit and what to do, cut to `size` bytes with the ending zero.
 * Returns the length of the whole sentence. */
TRAMMEL_TAP_API size_t trammel_tap_explain(const trammel_tap_finding* finding, char* text,
                                           size_t size);

#ifdef __cplusplus
}
#endif

#endif
