// HTTP request to an untrusted server.
#pragma once

#include <cstdint>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "machine/net/byte_stream.h"
#include "machine/net/http.h"

namespace trammel::machine {

/// Answer whose head was read.
struct HttpAnswer {
  ByteStream stream;
  HttpHead head;
  std::vector<std::uint8_t> rest;  ///< body bytes already read
};

/// Connects, sends a request and reads the answer's head, before the deadline on HostNow()'s clock.
/// An answer before the whole request was read is accepted.
/// Errors: those of ByteStream; kMachine: no answer in time, an answer that is not HTTP, a head of
/// more than 64 kB.
[[nodiscard]] Result<HttpAnswer> SendHttp(const Endpoint& endpoint, std::string_view request,
                                          double deadline_s, const std::stop_token& stop);

/// Reads the body: of the length in the head, in chunks, or until the server closes. Errors: those
/// of ByteStream; kMachine: truncated, or incomplete in time; kInput: more than `most_bytes`.
[[nodiscard]] Result<std::string> ReadHttpBody(HttpAnswer answer, std::size_t max_bytes,
                                               double deadline_s, const std::stop_token& stop);

}  // namespace trammel::machine
