// What a failure to reach a server means and what to do about it.
#pragma once

#include <boost/system/error_code.hpp>
#include <string>

#include "machine/moonraker/moonraker_address.h"

namespace trammel::machine {

enum class NetStep { kLookUp, kConnect, kTalk };

/// One sentence: which step towards the server failed, what came back, what to do.
[[nodiscard]] std::string NetFailure(NetStep step, const boost::system::error_code& error,
                                     const MoonrakerAddress& address, double time_limit_s);

/// What an HTTP answer that is not the wanted one means.
/// @param status  the HTTP status code
/// @param server  the answer's Server header, may be empty
[[nodiscard]] std::string HttpRefusal(int status, std::string_view server,
                                      const MoonrakerAddress& address, bool had_key);

}  // namespace trammel::machine
