// Unpacking: recovers the values of a table, to the bit, from the codes that gpgpu_rt/web/packing.py wrote.

async function inflated(base64) {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function unpacked(packed) {
    const bytes = await inflated(packed.data), {width} = packed;
    const floats = new Float32Array(Math.ceil(packed.values / width) * width), bits = new Int32Array(floats.buffer);
    const all = Uint32Array.from({length: floats.length / width}, (_, row) => row);
    let at = 0;

    function decode(column, rows, [kind, prediction, planes]) {
        let before = prediction === "fresh" ? -1 : 0;   // the previous number; with "fresh", the largest number so far
        rows.forEach((row, k) => {
            let code = 0;
            for (let plane = 0; plane < planes; ++plane) code |= bytes[at + plane * rows.length + k] << 8 * plane;
            let number = (code >>> 1) ^ -(code & 1);
            if (prediction === "previous") before = number = (before + number) | 0;
            else if (prediction === "row") number += row;
            else if (prediction === "fresh") {
                number = code === 0 ? before + 1 : code - 2;
                before = Math.max(before, number);
            }
            const place = row * width + column;
            if (kind === "integer") floats[place] = number;
            else bits[place] = number ^ (number >> 31 & 0x7fffffff);
        });
        at += planes * rows.length;
    }

    for (const [column, codes] of packed.columns) {
        const [key, last, each] = codes;
        if (Array.isArray(each)) {
            const value = (row) => Math.max(0, Math.min(last, floats[row * width + key]));
            each.forEach((one, c) => decode(column, all.filter((row) => value(row) === c), one));
        } else {
            decode(column, all, codes);
        }
    }
    return floats.subarray(0, packed.values);
}
