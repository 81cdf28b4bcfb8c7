// What the module with Aravis does: trammel-aravis.so.
#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "machine/camera/camera.h"

namespace trammel::machine {

struct AravisModule {
  /// OpenAravisCamera()'s contract, for an id that can be one.
  Result<std::unique_ptr<FrameSource>> (*open)(const std::string& id, const CameraOptions& options,
                                               const std::stop_token& stop);
};

}  // namespace trammel::machine
