// Reads what `daylight export` writes and makes the lightmap of any time of the day. No other program is needed. docs/daylight-export.md
// describes the files; samples/daylight/rebuild.py does the same in Python.

const R8G8B8A8_SNORM = 38, R16G16B16A16_SFLOAT = 97, R32_UINT = 98, R32_SFLOAT = 100;

// All 16-bit floats as numbers.
const HALVES = Float32Array.from({ length: 65536 }, (_, bits) => {
    const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, fraction = bits & 1023;
    if (exponent === 31) return fraction ? NaN : sign * Infinity;
    return sign * (exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : (2 ** -14 * fraction) / 1024);
});

// The largest level of a KTX 2.0 file: { width, height, data }.
export function readKtx2(buffer) {
    const view = new DataView(buffer), word = (at) => view.getUint32(at, true);
    const [format, width, height, offset, length] = [12, 20, 24, 80, 88].map(word);
    switch (format) {
        case R8G8B8A8_SNORM:
            return { width, height, data: Float32Array.from(new Int8Array(buffer, offset, length), (value) => Math.max(value, -127) / 127) };
        case R16G16B16A16_SFLOAT:
            return { width, height, data: Float32Array.from(new Uint16Array(buffer, offset, length / 2), (bits) => HALVES[bits]) };
        case R32_UINT:
            return { width, height, data: new Uint32Array(buffer, offset, length / 4) };
        case R32_SFLOAT:
            return { width, height, data: new Float32Array(buffer, offset, length / 4) };
    }
    throw new Error(`KTX2 with VkFormat ${format} is not read here`);
}

export class Lightmaps {
    // The light from outside at each minute of each day.
    pictures = new Map();

    static async load(folder) {
        const get = async (name) => {
            const answer = await fetch(`${folder}/${name}`);
            if (!answer.ok) throw new Error(`${folder}/${name}: ${answer.status}`);
            return answer;
        };
        const ktx2 = async (name) => readKtx2(await (await get(name)).arrayBuffer());
        const out = new Lightmaps();
        out.table = await (await get('daylight.json')).json();
        if (![1, 2].includes(out.table.version)) throw new Error(`version ${out.table.version} is not known, only 1 and 2`);
        out.sources = (await ktx2(out.table.sources)).data;
        // The days of the bake; a bake of one day has its members beside the others.
        out.days = out.table.days ?? [out.table];
        for (const day of out.days) out.pictures.set(day, await ktx2(day.moments.file));
        out.day = out.days[0];
        out.groups = out.table.lamps ?? [];
        out.layers = [];
        for (const layer of out.table.layers) {
            const pages = await Promise.all(layer.pages.map(ktx2));
            out.layers.push({ ...layer, pages, coefficients: layer.table ? (await ktx2(layer.table)).data : [] });
        }
        return out;
    }

    // Chooses the day of the times that follow.
    use(date) {
        const found = this.days.find(({ day }) => day.date === date);
        if (!found) throw new Error(`${date} is not in the export; it has ${this.days.map(({ day }) => day.date).join(', ')}`);
        this.day = found;
    }

    // How bright each group of lamps burns by the schedule, 0 to 1.
    burning(seconds) {
        return (this.day.switches ?? []).map((points) => {
            const next = points.findIndex(([at]) => at > seconds);
            if (next <= 0) return points[next < 0 ? points.length - 1 : 0][1];
            const [[begin, from], [end, to]] = [points[next - 1], points[next]];
            return from + ((to - from) * (seconds - begin)) / (end - begin);
        });
    }

    // The light from outside: { sun: [r, g, b], direction: [x, y, z], patches: [[r, g, b], …] }.
    moment(seconds) {
        const { first_seconds, step_seconds, rows, patches, sun_column, direction_column } = this.day.moments;
        const x = (seconds - first_seconds) / step_seconds, { width, data } = this.pictures.get(this.day);
        const dark = x < 0 || x > rows - 1;
        const row = Math.min(Math.max(Math.floor(x), 0), rows - 1), next = Math.min(row + 1, rows - 1), part = dark ? 0 : x - row;
        const at = (column) => [0, 1, 2].map((channel) => {
            const value = (r) => data[4 * (r * width + column) + channel];
            return (1 - part) * value(row) + part * value(next);
        });
        const light = (column) => (dark ? [0, 0, 0] : at(column));
        return { sun: light(sun_column), direction: at(direction_column), patches: Array.from({ length: patches }, (_, patch) => light(patch)) };
    }

    // Two baked times and their weights: a line between them, and over a night the nearer one.
    weights(seconds) {
        const { times, nights, day, first_column: first = 0 } = this.day, count = times.length;
        if (!count) return [];
        // After the last time comes the first one of the next day.
        const found = times.findIndex((time) => time > seconds), next = found < 0 ? count : found;
        const before = (next + count - 1) % count, after = next % count;
        const begin = times[before] - (next === 0 ? day.seconds : 0), end = times[after] + (next === count ? day.seconds : 0);
        const part = (seconds - begin) / (end - begin);
        if (nights.includes(before)) return [[first + (part < 0.5 ? before : after), 1]];
        return [[first + before, 1 - part], [first + after, part]];
    }

    // Irradiance of all texels at a time: four numbers for each, row after row from the top. `lamps`: how bright each group burns.
    light(seconds, lamps = this.burning(seconds)) {
        const { width, height, tiles } = this.table, { sun, patches } = this.moment(seconds);
        const mixtures = {
            times: this.weights(seconds).map(([time, weight]) => [time, sun.map((channel) => channel * weight)]),
            patches: patches.map((colour, patch) => [patch, colour]),
            lamps: lamps.map((share, group) => [group, [share, share, share]]),
        };
        const own = new Float32Array(4 * width * height);
        for (const { name, dimensions, columns, pages, coefficients } of this.layers) {
            for (const tile of tiles) {
                const { row, images } = tile[name];
                images.forEach(([page, left, top], image) => {
                    const sum = [0, 0, 0];
                    for (const [column, colour] of mixtures[dimensions]) {
                        const along = coefficients[(row + image) * columns + column];
                        for (let channel = 0; channel < 3; ++channel) sum[channel] += along * colour[channel];
                    }
                    for (let y = 0; y < tile.height; ++y) {
                        for (let x = 0; x < tile.width; ++x) {
                            const from = 4 * ((top + y) * pages[page].width + left + x), to = 4 * ((tile.y + y) * width + tile.x + x);
                            for (let channel = 0; channel < 3; ++channel) own[to + channel] += sum[channel] * pages[page].data[from + channel];
                        }
                    }
                });
            }
        }
        // Texels in the padding show the nearest texel on a surface. Beside the charts of a lightmap they continue the light of the last two texels of a
        // row or column.
        const out = new Float32Array(own.length), { sources } = this, isCube = this.table.kind === 'cube';
        const at = (texel, channel) => Math.max(own[4 * texel + channel], 0);
        sources.forEach((source, texel) => {
            const by = source - texel, far = source + by;
            const beside = Math.abs(by) === width || (Math.abs(by) === 1 && Math.floor(source / width) === Math.floor(texel / width));
            const continues = !isCube && beside && sources[far] === far;
            for (let channel = 0; channel < 3; ++channel) {
                const near = source < sources.length ? at(source, channel) : 0;
                const beyond = () => Math.min(Math.max(2 * near - at(far, channel), near / 2), 2 * near);
                out[4 * texel + channel] = continues ? beyond() : near;
            }
            out[4 * texel + 3] = 1;
        });
        return out;
    }
}
