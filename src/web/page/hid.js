// Devices that speak HID: the page asks the user for them, the lesson's worker opens them (`page_worker.rs` in the crate `app`).

const isOurs = ({ vendorId, productId, collections }, { vendor, products, usage }) => vendorId === vendor
  && (!products.length || products.includes(productId))
  && (!usage || collections.some(({ usagePage, usage: its }) => usagePage === usage[0] && its === usage[1]));

const filters = kinds => kinds.flatMap(({ vendor, products, usage }) => (products.length ? products : [undefined]).map(product => ({
  vendorId: vendor, ...(product && { productId: product }), ...(usage && { usagePage: usage[0], usage: usage[1] }),
})));

globalThis.typodontHid = {
  /** Asks the user for a device, and returns its name; undefined if none was chosen. */
  ask: async kinds => {
    if (!navigator.hid) throw new Error("WebHID");
    const [device] = await navigator.hid.requestDevice({ filters: filters(kinds) });
    return device?.productName;
  },

  /**
   * Opens the devices of these kinds that the user has allowed, now and whenever one is plugged in. Calls `connected(number, vendor,
   * product, usagePage, usage, name)`, then `received(number, id, bytes)` for each report, and `gone(number)`. Returns a function
   * that sends a report to the device with a number.
   */
  serve: (kinds, connected, received, gone) => {
    const open = new Map();
    let count = 0;
    const take = async device => {
      const kind = kinds.find(kind => isOurs(device, kind));
      if (!kind || [...open.values()].includes(device)) return;
      const number = ++count;
      open.set(number, device);
      try {
        if (!device.opened) await device.open();
      } catch (error) {
        open.delete(number);
        console.warn(`typodont: ${device.productName}: ${error.message}`);
        return;
      }
      connected(number, device.vendorId, device.productId, ...(kind.usage ?? [0, 0]), device.productName);
      device.oninputreport = ({ reportId, data }) =>
        received(number, reportId, new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
    };
    navigator.hid?.addEventListener("connect", ({ device }) => take(device));
    navigator.hid?.addEventListener("disconnect", ({ device }) => {
      for (const [number, other] of open) {
        if (other === device) {
          open.delete(number);
          gone(number);
        }
      }
    });
    navigator.hid?.getDevices().then(devices => devices.forEach(take)).catch(() => {});
    // A device that takes no reports is noticed by its silence.
    return (number, id, bytes) => open.get(number)?.sendReport(id, bytes).catch(() => {});
  },
};
