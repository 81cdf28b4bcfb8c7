// trammel-step.so.
#include "machine/cad/step_module.h"

#include <algorithm>
#include <span>
#include <utility>

#include "machine/cad/step_solid.h"
#include "machine/cad/step_triangles.h"
#include "machine/module/module.h"

namespace trammel::machine {
namespace {

template <class T>
bool SendAll(const ChildSender& sender, StepMessage kind, const std::vector<T>& values) {
  constexpr std::size_t kPiece = (std::size_t{1} << 20U) / sizeof(T);
  for (std::size_t at = 0; at < values.size(); at += kPiece) {
    const std::span piece(values.data() + at, std::min(kPiece, values.size() - at));
    const auto bytes = std::as_bytes(piece);
    if (!sender.Send(
            kind, std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()))) {
      return false;
    }
  }
  return true;
}

Result<void> SendSolid(std::string_view text, const StepReadOptions& options,
                       const ChildSender& sender) {
  auto read = TRY(SolidOf(text));
  const auto made = TRY(TrianglesOf(read.solid, options));
  const StepHead head{made.vertices_mm.size(), made.triangles.size(), made.faces,
                      made.chord_error_mm};
  sender.Send(kStepHead, std::span(reinterpret_cast<const std::uint8_t*>(&head), sizeof head));
  sender.Send(kStepUnit, read.unit);
  for (const std::string& notice : read.notices) sender.Send(kStepNotice, notice);
  static_cast<void>(SendAll(sender, kStepVertices, made.vertices_mm) &&
                    SendAll(sender, kStepTriangles, made.triangles) &&
                    SendAll(sender, kStepLifts, made.lifts));
  return {};
}

constexpr StepModule kModule = {SendSolid};

}  // namespace
}  // namespace trammel::machine

TRAMMEL_MODULE(trammel::machine::kModule)
