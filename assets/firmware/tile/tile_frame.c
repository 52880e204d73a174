#include "tile_frame.h"
#include <stdio.h>

enum { FORCES = 1, ACCELERATION = 2, CHECKED = 17, RAW = CHECKED + 4 };

/* CRC-32 of Ethernet and zlib, four bits at a time: sixteen numbers fit where 256 would not. */
static uint32_t checksum(const uint8_t *bytes, size_t count) {
    static const uint32_t step[16] = {
        0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4, 0x4DB26158, 0x5005713C,
        0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C, 0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C,
    };
    uint32_t check = 0xFFFFFFFF;
    for (size_t i = 0; i < count; i++) {
        check ^= bytes[i];
        check = step[check & 15] ^ (check >> 4);
        check = step[check & 15] ^ (check >> 4);
    }
    return ~check;
}

static uint8_t *put(uint8_t *to, uint32_t value, uint8_t size) {
    while (size--) {
        *to++ = (uint8_t)value;
        value >>= 8;
    }
    return to;
}

static size_t encode(uint8_t *out, uint8_t kind, uint16_t tile, uint16_t sequence, uint32_t microseconds,
                     const uint16_t readings[4]) {
    uint8_t *raw = out + 1;
    uint8_t *to = put(raw, kind, 1);
    to = put(to, tile, 2);
    to = put(to, sequence, 2);
    to = put(to, microseconds, 4);
    for (int i = 0; i < 4; i++)
        to = put(to, readings[i], 2);
    put(to, checksum(raw, CHECKED), 4);

    /* Every zero gives way to the distance to the next; the first of these distances stands in front. */
    uint8_t code = 0;
    for (uint8_t i = 1; i <= RAW; i++) {
        if (out[i] == 0) {
            out[code] = (uint8_t)(i - code);
            code = i;
        }
    }
    out[code] = (uint8_t)(RAW + 1 - code);
    out[RAW + 1] = 0;
    return TILE_FRAME_SIZE;
}

size_t tile_frame_encode(uint8_t out[TILE_FRAME_SIZE], uint16_t tile, uint16_t sequence, uint32_t microseconds,
                         const uint16_t readings[4]) {
    return encode(out, FORCES, tile, sequence, microseconds, readings);
}

size_t tile_frame_encode_acceleration(uint8_t out[TILE_FRAME_SIZE], uint16_t tile, uint16_t sequence,
                                      uint32_t microseconds, const uint16_t readings[4]) {
    return encode(out, ACCELERATION, tile, sequence, microseconds, readings);
}

size_t tile_line_encode(char out[TILE_LINE_SIZE], uint16_t tile, uint16_t sequence, uint32_t microseconds,
                        const uint16_t readings[4]) {
    const int length = snprintf(out, TILE_LINE_SIZE, "%u,%u,%lu,%u,%u,%u,%u", (unsigned)tile, (unsigned)sequence,
                                (unsigned long)microseconds, (unsigned)readings[0], (unsigned)readings[1],
                                (unsigned)readings[2], (unsigned)readings[3]);
    uint8_t check = 0;
    for (int i = 0; i < length; i++)
        check ^= (uint8_t)out[i];
    return (size_t)(length + snprintf(out + length, (size_t)(TILE_LINE_SIZE - length), "*%02X\n", (unsigned)check));
}
