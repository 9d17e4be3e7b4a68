// The glTF validator of Khronos (npm gltf-validator) on a file. validate.cjs NODE_MODULES FILE; ends with 1 if there is an error.
const fs = require('fs');
const path = require('path');

const [, , modules, file] = process.argv;
const validator = require(path.join(modules, 'gltf-validator'));
const beside = (uri) => fs.promises.readFile(path.join(path.dirname(file), decodeURIComponent(uri)));

validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { externalResourceFunction: async (uri) => new Uint8Array(await beside(uri)) }).then(({ issues }) => {
    const { numErrors, numWarnings, numInfos, messages } = issues;
    console.log(`${numErrors} errors, ${numWarnings} warnings, ${numInfos} remarks`);
    for (const { severity, code, pointer } of messages) if (severity < 2) console.log(`  ${code} ${pointer}`);
    process.exit(numErrors ? 1 : 0);
});
