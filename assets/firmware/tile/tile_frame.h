/* A tile's frame on the wire: 23 bytes, of which only the last is zero. See README.md beside the sketch. */
#ifndef TILE_FRAME_H
#define TILE_FRAME_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { TILE_FRAME_SIZE = 23, TILE_LINE_SIZE = 52 };

/* Write one frame to `out` and return its size. Counts: `tile` from 0, `sequence` one more with each sample of this
   tile, `microseconds` of the device; both go round. `readings` are 0 to 65535 whatever the converter's width. */
size_t tile_frame_encode(uint8_t out[TILE_FRAME_SIZE], uint16_t tile, uint16_t sequence, uint32_t microseconds,
                         const uint16_t readings[4]);

/* The same for four samples of an accelerometer: 32768 at rest, the last one at `microseconds`, the others evenly
   spaced since the frame before. `sequence` counts these frames alone. */
size_t tile_frame_encode_acceleration(uint8_t out[TILE_FRAME_SIZE], uint16_t tile, uint16_t sequence,
                                      uint32_t microseconds, const uint16_t readings[4]);

/* The same sample as a line of text with a checksum, and a zero behind it; returns its length. */
size_t tile_line_encode(char out[TILE_LINE_SIZE], uint16_t tile, uint16_t sequence, uint32_t microseconds,
                        const uint16_t readings[4]);

#ifdef __cplusplus
}
#endif

#endif
