// C interface include/trammel/tap.h, on top of AnalyseTap.
#include <trammel/tap.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

#include "tap/analyse/analyse.h"
#include "tap/samples/finding.h"
#include "tap/samples/motion.h"
#include "tap/two_line/corner_name.h"

namespace {

using trammel::Verdict;
using trammel::tap::Corner;
using trammel::tap::Finding;
using trammel::tap::FindingCode;
using trammel::tap::Method;
using trammel::tap::Move;
using trammel::tap::TapAnalysis;
using trammel::tap::TapOptions;
using trammel::tap::TapView;
using trammel::tap::Workspace;

// The caller's arrays are read as the library's own.
static_assert(sizeof(trammel_tap_move) == sizeof(Move));
static_assert(offsetof(trammel_tap_move, duration_s) == offsetof(Move, duration_s));
static_assert(offsetof(trammel_tap_move, z_direction) == offsetof(Move, z_direction));
static_assert(TRAMMEL_TAP_APPROACH_START == static_cast<int>(Corner::kApproachStart));
static_assert(TRAMMEL_TAP_COLLISION == static_cast<int>(Corner::kCollision));
static_assert(TRAMMEL_TAP_PRESS_END == static_cast<int>(Corner::kPressEnd));
static_assert(TRAMMEL_TAP_DWELL_END == static_cast<int>(Corner::kDwellEnd));
static_assert(TRAMMEL_TAP_DECOMPRESSION_SPLIT == static_cast<int>(Corner::kDecompressionSplit));
static_assert(TRAMMEL_TAP_BREAK == static_cast<int>(Corner::kBreak));
static_assert(TRAMMEL_TAP_PULL_BACK_END == static_cast<int>(Corner::kPullBackEnd));
static_assert(TRAMMEL_TAP_MAX_POINTS == TapAnalysis::kMaxPoints);
static_assert(TRAMMEL_TAP_MAX_NOTICES == TapAnalysis::kMaxNotices);

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

trammel_tap_options Defaults() {
  return {sizeof(trammel_tap_options),
          TRAMMEL_TAP_METHOD_CONTACT,
          0,
          kUnknown,
          0,
          kUnknown,
          kUnknown,
          kUnknown};
}

// Fields unknown to an older caller have their defaults.
bool ReadOptions(const trammel_tap_options* given, TapOptions& options) {
  trammel_tap_options known = Defaults();
  if (given != nullptr) {
    std::memcpy(&known, given, std::min(given->struct_size, sizeof known));
  }
  options.latency_s = known.latency_s;
  options.latency_uncertainty_s = known.latency_uncertainty_s;
  options.nozzle_temperature_c = known.nozzle_temperature_c;
  options.trigger_force_g = known.trigger_force_g;
  options.decompression_angle_rad = known.decompression_angle_rad;
  options.method = static_cast<Method>(known.method);
  constexpr double kMaxLatency_s = 10;
  return (known.method == TRAMMEL_TAP_METHOD_CONTACT ||
          known.method == TRAMMEL_TAP_METHOD_TWO_LINE) &&
         (std::isnan(known.latency_s) || std::abs(known.latency_s) <= kMaxLatency_s) &&
         known.latency_uncertainty_s >= 0 && known.latency_uncertainty_s <= kMaxLatency_s;
}

trammel_tap_finding ToC(const Finding& finding) {
  return {static_cast<std::int32_t>(finding.code), 0, finding.figure, finding.limit};
}

std::int32_t ToC(Verdict verdict) {
  switch (verdict) {
    case Verdict::kGood:
      return TRAMMEL_TAP_GOOD;
    case Verdict::kCannotTell:
      return TRAMMEL_TAP_CANNOT_TELL;
    case Verdict::kRefused:
      return TRAMMEL_TAP_REFUSED;
  }
  return TRAMMEL_TAP_REFUSED;
}

trammel_tap_result ToC(const TapAnalysis& analysis) {
  trammel_tap_result result{};
  result.verdict = ToC(analysis.verdict);
  result.method = static_cast<std::int32_t>(analysis.method);
  result.reason = ToC(analysis.reason);
  result.contact_z_mm = analysis.contact_mm.value;
  result.contact_time_s = analysis.contact_time_s;
  result.standard_uncertainty_mm = analysis.contact_mm.standard_uncertainty;
  result.interval95_lo_mm = analysis.contact_mm.interval95.lo;
  result.interval95_hi_mm = analysis.contact_mm.interval95.hi;
  result.quality = analysis.quality;
  result.noise_g = analysis.noise_g;
  result.point_count = static_cast<std::int32_t>(analysis.point_count);
  result.notice_count = static_cast<std::int32_t>(analysis.notice_count);
  std::size_t i = 0;
  for (const auto& point : analysis.Points()) {
    result.points[i++] = {static_cast<std::int32_t>(point.corner), 0, point.time_s, point.z_mm,
                          point.force_g};
  }
  i = 0;
  for (const Finding& notice : analysis.Notices()) {
    result.notices[i++] = ToC(notice);
  }
  return result;
}

template <std::size_t kCount>
const char* NameOf(const std::array<const char*, kCount>& names, std::int32_t index) {
  return index >= 0 && static_cast<std::size_t>(index) < kCount
             ? names[static_cast<std::size_t>(index)]
             : "";
}

}  // namespace

extern "C" {

std::int32_t trammel_tap_version(void) { return TRAMMEL_TAP_VERSION; }

std::size_t trammel_tap_workspace_bytes(std::size_t samples) {
  return trammel::tap::WorkspaceBytes(std::min(samples, trammel::tap::kMaxSamples));
}

void trammel_tap_default_options(trammel_tap_options* options, std::size_t options_size) {
  if (options != nullptr && options_size >= sizeof options->struct_size) {
    trammel_tap_options defaults = Defaults();
    defaults.struct_size = std::min(options_size, sizeof defaults);
    std::memcpy(options, &defaults, defaults.struct_size);
  }
}

trammel_tap_status trammel_tap_analyse(const double* time_s, const double* force_g,
                                       std::size_t samples, const trammel_tap_move* moves,
                                       std::size_t move_count, const trammel_tap_options* options,
                                       void* workspace, std::size_t workspace_bytes,
                                       trammel_tap_result* result) {
  TapOptions own_options;
  // Requires the first fields, which contain the outcome.
  constexpr std::size_t kMinResult = offsetof(trammel_tap_result, point_count);
  if (result == nullptr || result->struct_size < kMinResult ||
      (samples > 0 && (time_s == nullptr || force_g == nullptr)) ||
      (move_count > 0 && moves == nullptr) || (workspace_bytes > 0 && workspace == nullptr) ||
      !ReadOptions(options, own_options)) {
    return TRAMMEL_TAP_BAD_ARGUMENT;
  }
  if (workspace_bytes < trammel_tap_workspace_bytes(samples)) {
    return TRAMMEL_TAP_SMALL_WORKSPACE;
  }
  // Nothing in it should throw; a bug must still not unwind through C.
  try {
    Workspace own_workspace({static_cast<std::byte*>(workspace), workspace_bytes});
    const TapView tap = {
        {time_s, samples}, {force_g, samples}, {reinterpret_cast<const Move*>(moves), move_count}};
    trammel_tap_result whole = ToC(AnalyseTap(tap, own_options, own_workspace));
    whole.struct_size = result->struct_size;
    std::memcpy(result, &whole, std::min(result->struct_size, sizeof whole));
    return TRAMMEL_TAP_OK;
  } catch (...) {
    return TRAMMEL_TAP_BUG;
  }
}

const char* trammel_tap_verdict_name(std::int32_t verdict) {
  constexpr std::array<const char*, 3> kNames = {"good", "cannot_tell", "refused"};
  return NameOf(kNames, verdict);
}

const char* trammel_tap_method_name(std::int32_t method) {
  constexpr std::array<const char*, 2> kNames = {"contact", "two-line"};
  return NameOf(kNames, method);
}

const char* trammel_tap_finding_name(std::int32_t code) {
  // All names are zero-terminated literals.
  return code >= 0 && code <= std::numeric_limits<std::uint8_t>::max()
             ? trammel::tap::Name(static_cast<FindingCode>(code)).data()
             : "";
}

const char* trammel_tap_corner_name(std::int32_t corner) {
  // All names are zero-terminated literals.
  return corner >= 0 && corner <= TRAMMEL_TAP_PULL_BACK_END
             ? trammel::tap::Name(static_cast<Corner>(corner)).data()
             : "";
}

const char* trammel_tap_status_name(trammel_tap_status status) {
  constexpr std::array<const char*, 4> kNames = {"ok", "bad_argument", "small_workspace", "bug"};
  return NameOf(kNames, static_cast<std::int32_t>(status));
}

std::size_t trammel_tap_explain(const trammel_tap_finding* finding, char* text, std::size_t size) {
  if (finding == nullptr || (size > 0 && text == nullptr) || finding->code < 0 ||
      finding->code > std::numeric_limits<std::uint8_t>::max()) {
    return 0;
  }
  try {
    return trammel::tap::ExplainTo(
        {text, size}, {static_cast<FindingCode>(finding->code), finding->figure, finding->limit});
  } catch (...) {
    return 0;
  }
}

}  // extern "C"
