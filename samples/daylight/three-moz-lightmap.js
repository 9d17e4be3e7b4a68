// MOZ_lightmap for three.js: a plug-in of its GLTFLoader. It reads the lightmap's picture (Radiance, MOZ_texture_rgbe) and gives it to the materials.
//   new GLTFLoader().register((parser) => new MozLightmap(parser));
// The picture holds irradiance E, which is what `lightMap` of three.js wants: its shader makes albedo / pi * E of it.
import * as THREE from 'three';
import { HDRLoader } from 'three/addons/loaders/HDRLoader.js';

export class MozLightmap {
    constructor(parser) {
        this.parser = parser;
        this.name = 'MOZ_lightmap';
        this.pictures = new Map();
    }

    // The picture of a texture; materials share it.
    picture(index) {
        const { json, options } = this.parser;
        const { source } = json.textures[index].extensions.MOZ_texture_rgbe;
        const address = THREE.LoaderUtils.resolveURL(json.images[source].uri, options.path);
        if (!this.pictures.has(index)) {
            const loader = new HDRLoader(options.manager).setDataType(THREE.HalfFloatType);
            // Texture coordinates of glTF begin in the upper left corner.
            this.pictures.set(index, loader.loadAsync(address).then((map) => Object.assign(map, { flipY: false, needsUpdate: true })));
        }
        return this.pictures.get(index);
    }

    async extendMaterialParams(material, parameters) {
        const use = this.parser.json.materials[material].extensions?.[this.name];
        if (!use) return;
        const map = (await this.picture(use.index)).clone();
        map.channel = use.texCoord ?? 1;
        Object.assign(parameters, { lightMap: map, lightMapIntensity: use.intensity ?? 1 });
    }
}
