#include "sim/camera/camera_test_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace trammel::sim {

CameraTestClient::CameraTestClient(int port, const std::string& target, const std::string& method,
                                   const std::string& headers)
    : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const std::string request = method + " " + target + " HTTP/1.1\r\n" + headers + "\r\n";
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      send(socket_, request.data(), request.size(), MSG_NOSIGNAL) !=
          static_cast<ssize_t>(request.size())) {
    close(socket_);
    throw std::runtime_error("cannot ask port " + std::to_string(port) + " for " + target);
  }
}

CameraTestClient::~CameraTestClient() { close(socket_); }

double CameraTestClient::Part::number(const std::string& header) const {
  const auto found = headers.find(header);
  if (found == headers.end()) throw std::runtime_error("no header " + header);
  return std::strtod(found->second.c_str(), nullptr);
}

bool CameraTestClient::Fill(const char* what) {
  pollfd waiting{socket_, POLLIN, 0};
  if (poll(&waiting, 1, 5000) <= 0) {
    throw std::runtime_error(std::string("5 s without ") + what +
                             "; so far: " + buffer_.substr(0, 200));
  }
  std::array<char, 65536> chunk;
  const ssize_t count = recv(socket_, chunk.data(), chunk.size(), 0);
  if (count <= 0) return false;
  buffer_.append(chunk.data(), static_cast<std::size_t>(count));
  return true;
}

std::string CameraTestClient::ReadHead() {
  std::size_t end = 0;
  while ((end = buffer_.find("\r\n\r\n")) == std::string::npos) {
    if (!Fill("the head of an answer")) throw std::runtime_error("closed before the head's end");
  }
  std::string head = buffer_.substr(0, end);
  buffer_.erase(0, end + 4);
  return head;
}

std::optional<CameraTestClient::Part> CameraTestClient::ReadPart() {
  std::size_t end = 0;
  while ((end = buffer_.find("\r\n\r\n")) == std::string::npos) {
    if (!Fill("a part's headers")) return std::nullopt;
  }
  Part part;
  std::istringstream lines(buffer_.substr(0, end));
  for (std::string line; std::getline(lines, line);) {
    if (line.ends_with('\r')) line.pop_back();
    const std::size_t colon = line.find(": ");
    if (colon != std::string::npos) part.headers[line.substr(0, colon)] = line.substr(colon + 2);
  }
  const auto size = static_cast<std::size_t>(part.number("Content-Length"));
  while (buffer_.size() < end + 4 + size) {
    if (!Fill("a part's picture")) return std::nullopt;
  }
  part.body = buffer_.substr(end + 4, size);
  buffer_.erase(0, end + 4 + size);
  return part;
}

std::string CameraTestClient::ReadAll() {
  while (Fill("the end of an answer")) {
  }
  return buffer_;
}

Frame DecodeJpeg(const std::string& jpeg) {
  const std::vector<std::uint8_t> bytes(jpeg.begin(), jpeg.end());
  const cv::Mat image = cv::imdecode(bytes, cv::IMREAD_COLOR);
  if (image.empty()) throw std::runtime_error("no JPEG");
  Frame frame(image.cols, image.rows);
  for (int row = 0; row < image.rows; ++row) {
    std::memcpy(frame.row(row), image.ptr(row), static_cast<std::size_t>(image.cols) * 3);
  }
  return frame;
}

}  // namespace trammel::sim
