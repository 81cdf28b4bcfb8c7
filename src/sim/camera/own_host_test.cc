#include <gtest/gtest.h>

#include "sim/camera/camera_http.h"

namespace trammel::sim {
namespace {

TEST(OwnHost, IsThisComputerByWhateverPort) {
  for (const char* host :
       {"", "127.0.0.1", "127.0.0.1:7125", "localhost:80", "LocalHost", "[::1]", "[::1]:7125"}) {
    EXPECT_TRUE(IsOwnHost(host)) << host;
  }
}

TEST(OwnHost, IsNoNameThatWasMadeToPointHere) {
  for (const char* host :
       {"evil.example", "evil.example:7125", "127.0.0.1.evil.example", "localhost.evil.example:80",
        "127.0.0.1:80@evil.example", "[::1].evil", "[::1", "127.0.0.1:x", "0.0.0.0"}) {
    EXPECT_FALSE(IsOwnHost(host)) << host;
  }
}

TEST(OwnHost, AnOriginIsAPageOfThisComputer) {
  for (const char* origin : {"", "http://localhost:8080", "https://127.0.0.1", "http://[::1]:80"}) {
    EXPECT_TRUE(IsOwnOrigin(origin)) << origin;
  }
  for (const char* origin : {"null", "http://", "http://evil.example", "file://", "localhost",
                             "http://localhost.evil.example"}) {
    EXPECT_FALSE(IsOwnOrigin(origin)) << origin;
  }
}

}  // namespace
}  // namespace trammel::sim
