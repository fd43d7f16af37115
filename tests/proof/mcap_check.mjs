// Reads MCAP files with the official packages for JavaScript, as a stream with every checksum looked at
// and by the index, and compares what both find.
import { open, readFile } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";

const decompressHandlers = await loadDecompressHandlers();

/** Messages on each topic, read as a stream. */
async function streamed(name) {
  const reader = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  reader.append(await readFile(name));
  const topics = new Map();
  const counts = new Map();
  let end = false;
  for (let record; (record = reader.nextRecord()) != undefined; ) {
    if (record.type === "Channel") topics.set(record.id, record.topic);
    if (record.type === "DataEnd") end = true;
    if (record.type === "Message") {
      const topic = topics.get(record.channelId);
      counts.set(topic, (counts.get(topic) ?? 0) + 1);
    }
  }
  if (!end || !reader.done() || reader.bytesRemaining() !== 0) {
    throw new Error(`${name}: the stream does not end as it should`);
  }
  return counts;
}

/** Messages on each topic, found by the index, and whether their log times rise; nothing of a file without chunks, which has none. */
async function indexed(name) {
  const file = await open(name);
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, size) => {
      const buffer = new Uint8Array(Number(size));
      const { bytesRead } = await file.read(buffer, 0, Number(size), Number(offset));
      if (bytesRead !== Number(size)) throw new Error(`${name}: read past the end`);
      return buffer;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  if (reader.chunkIndexes.length === 0) {
    await file.close();
    return undefined;
  }
  const counts = new Map();
  let last = 0n;
  for await (const message of reader.readMessages()) {
    if (message.logTime < last) throw new Error(`${name}: log times fall`);
    last = message.logTime;
    const topic = reader.channelsById.get(message.channelId).topic;
    counts.set(topic, (counts.get(topic) ?? 0) + 1);
  }
  await file.close();
  return counts;
}

const text = (counts) => JSON.stringify([...counts].sort());
for (const name of process.argv.slice(2)) {
  const [a, b] = [await streamed(name), await indexed(name)];
  if (a.size === 0 || (b !== undefined && text(a) !== text(b))) {
    throw new Error(`${name}: the stream holds ${text(a)}, the index leads to ${text(b)}`);
  }
  console.log(`${name}: ${text(a)}${b === undefined ? " (no chunks, no index)" : ""}`);
}
