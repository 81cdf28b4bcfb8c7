// Stands in for libGL where OpenCV is linked statically (TRAMMEL_OPENCV_STATIC): its core looks up
// OpenGL's functions through these, and only when a program draws with OpenGL.
extern "C" {
void (*glXGetProcAddressARB(const unsigned char* /*name*/))() { return nullptr; }
void* glXGetCurrentContext() { return nullptr; }
void* glXGetCurrentDisplay() { return nullptr; }
}
