#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "machine/camera/aravis_camera.h"
#include "machine/camera/aravis_module.h"
#include "machine/module/module.h"

namespace trammel::machine {

std::optional<std::string> AravisId(const std::string& address) {
  constexpr std::string_view kScheme = "aravis:";
  if (!address.starts_with(kScheme)) return std::nullopt;
  return address.substr(kScheme.size());
}

Result<std::unique_ptr<FrameSource>> OpenAravisCamera(const std::string& id,
                                                      const CameraOptions& options,
                                                      const std::stop_token& stop) {
  constexpr std::size_t kLongestId = 256;
  const bool printable =
      std::all_of(id.begin(), id.end(), [](char c) { return c >= ' ' && c <= '~'; });
  if (id.size() > kLongestId || !printable) {
    return Fail(
        fmt::format("camera aravis: an id of {} characters{}; write it as arv-tool-0.8 "
                    "lists it, at most {} printable characters",
                    id.size(), printable ? "" : ", not all of them printable", kLongestId));
  }
  const auto module = TRY(LoadModule<AravisModule>(kAravisModule));
  return module->open(id, options, stop);
}

}  // namespace trammel::machine
