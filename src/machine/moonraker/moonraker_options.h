// Where a printer's Moonraker is and how to be let in.
#pragma once

#include <cstddef>
#include <string>

namespace trammel::machine {

/// Validated by ParseMoonrakerAddress when connecting; a wrong field fails with kInput.
struct MoonrakerOptions {
  /// "voron.local", "192.168.1.20:7125", "http://…", "https://…", "ws://…/websocket", "wss://…",
  /// or "unix:/home/pi/printer_data/comms/moonraker.sock". Where not given: port 7125 without a
  /// scheme, 80 with http and ws, 443 with TLS; path /websocket.
  std::string address = "localhost";
  /// Where files are uploaded when `address` is a Unix socket, which takes no files.
  std::string http_address = "http://localhost:7125";
  std::string api_key = {};         ///< empty: none. Sent as X-Api-Key and in identify.
  std::string one_shot_token = {};  ///< empty: none. Good for one connection, not for reconnecting.
  std::string ca_file = {};         ///< PEM; empty: the system's authorities
  bool accept_any_certificate =
      false;  ///< for self-signed ones; anyone could then pose as the printer
  std::string client_name = "trammel";  ///< as other clients see it; one agent per name
  std::string client_version = "0.1";   ///< likewise
  /// Where an agent has the name: takes name-2 … name-9. Otherwise the connection fails, and is
  /// tried again like any that is lost: for an agent that others call by its name.
  bool other_names = true;
  bool quote_messages = false;       ///< errors end with the last messages of the conversation
  double connect_time_limit_s = 10;  ///< of one attempt, 0.1 … 600
  std::size_t max_message_bytes = std::size_t{16}
                                  << 20;  ///< of an incoming message; a long configuration has 1 MB
  std::size_t max_queued_bytes = std::size_t{16} << 20;  ///< of outgoing messages that wait
};

}  // namespace trammel::machine
