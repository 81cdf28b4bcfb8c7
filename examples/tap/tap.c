/* Reads one tap from a small CSV file and prints its contact height.
 *
 *     cc -std=c99 tap.c -ltrammel_tap -lm -o tap && ./tap tap.csv
 *
 * Lines of the file: "sample,TIME,FORCE" and
 * "move,PRINT_TIME,MOVE_T,START_V,ACCEL,START_Z,Z_R"; others are ignored.
 */
#include <stdio.h>
#include <stdlib.h>
#include <trammel/tap.h>

enum { kMostSamples = 4000, kMostMoves = 16 };

static double time_s[kMostSamples];
static double force_g[kMostSamples];
static trammel_tap_move moves[kMostMoves];

int main(int argc, char** argv) {
  FILE* file = argc == 2 ? fopen(argv[1], "r") : NULL;
  if (file == NULL) {
    fprintf(stderr, "usage: %s TAP.CSV\n", argv[0]);
    return 1;
  }
  size_t samples = 0;
  size_t move_count = 0;
  char line[512];
  while (fgets(line, sizeof line, file) != NULL) {
    trammel_tap_move m;
    if (samples < kMostSamples &&
        sscanf(line, "sample,%lf,%lf", &time_s[samples], &force_g[samples]) == 2) {
      ++samples;
    } else if (move_count < kMostMoves &&
               sscanf(line, "move,%lf,%lf,%lf,%lf,%lf,%lf", &m.start_time_s, &m.duration_s,
                      &m.start_velocity_mm_s, &m.acceleration_mm_s2, &m.start_z_mm,
                      &m.z_direction) == 6) {
      moves[move_count++] = m;
    }
  }
  fclose(file);

  size_t bytes = trammel_tap_workspace_bytes(samples);
  void* workspace = malloc(bytes); /* Once; firmware would have it static. */
  trammel_tap_options options;
  trammel_tap_result result;
  trammel_tap_default_options(&options, sizeof options);
  result.struct_size = sizeof result;
  trammel_tap_status status = trammel_tap_analyse(time_s, force_g, samples, moves, move_count,
                                                  &options, workspace, bytes, &result);
  free(workspace);
  if (status != TRAMMEL_TAP_OK) {
    fprintf(stderr, "%s\n", trammel_tap_status_name(status));
    return 1;
  }
  char text[400];
  if (result.verdict == TRAMMEL_TAP_GOOD) {
    printf("%s: contact at z = %.5f mm, 95 %% interval %.5f to %.5f mm\n",
           trammel_tap_verdict_name(result.verdict), result.contact_z_mm, result.interval95_lo_mm,
           result.interval95_hi_mm);
  } else {
    trammel_tap_explain(&result.reason, text, sizeof text);
    printf("%s (%s): %s\n", trammel_tap_verdict_name(result.verdict),
           trammel_tap_finding_name(result.reason.code), text);
  }
  for (int i = 0; i < result.notice_count; ++i) {
    trammel_tap_explain(&result.notices[i], text, sizeof text);
    printf("  %s: %s\n", trammel_tap_finding_name(result.notices[i].code), text);
  }
  return result.verdict == TRAMMEL_TAP_GOOD ? 0 : 2;
}
