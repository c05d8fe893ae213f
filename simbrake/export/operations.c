#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#if defined(__GNUC__)
#define APART __attribute__((noinline, unused))
#define HELPER static inline __attribute__((unused))
#else
#define APART
#define HELPER static inline
#endif
HELPER double maximum(double a, double b) { return a != a ? a : b != b ? b : a > b ? a : b; }
HELPER double minimum(double a, double b) { return a != a ? a : b != b ? b : a < b ? a : b; }
HELPER double sign(double a) { return a != a ? a : (double)((a > 0) - (a < 0)); }
HELPER double square(double a) { return a * a; }
HELPER int64_t whole_maximum(int64_t a, int64_t b) { return a > b ? a : b; }
HELPER int64_t whole_minimum(int64_t a, int64_t b) { return a < b ? a : b; }
HELPER int64_t whole_abs(int64_t a) { return a < 0 ? -a : a; }
HELPER int64_t whole_sign(int64_t a) { return (a > 0) - (a < 0); }
HELPER int64_t divided(int64_t a, int64_t b) { return b == 0 ? -1 : b == -1 ? -a : a / b; }
HELPER int64_t remains(int64_t a, int64_t b) { return b == 0 ? a : b == -1 ? 0 : a % b; }
HELPER int64_t whole(double a) {
  return a != a ? 0 : a >= 9223372036854775807.0 ? INT64_MAX : a <= -9223372036854775808.0 ? INT64_MIN : (int64_t)a;
}
HELPER int32_t whole_32(double a) {
  return a != a ? 0 : a >= 2147483647.0 ? INT32_MAX : a <= -2147483648.0 ? INT32_MIN : (int32_t)a;
}
HELPER int64_t within(int64_t a, int64_t most) { return a < 0 ? 0 : a > most ? most : a; }
